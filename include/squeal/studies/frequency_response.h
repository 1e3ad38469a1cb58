#pragma once

#include <squeal/equations/sector.h>
#include <squeal/parameters/choices.h>
#include <squeal/projection/eigenpairs.h>

#include <complex>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace squeal
{
  /// Solves Q(i w) x = f, Q(l) = l^2 M + l P + Q + sum (f_b(l) - 1) c_b A_b: x exp(i w t) is the
  /// motion under f exp(i w t). In real arithmetic: with Q(i w) = A + i B by GMRES on
  ///     [A -B; B A] (Re x, Im x) = (f, 0),
  /// preconditioned with the factors of A, beside which B, damping and gyroscopic forces, is small
  /// but near resonances, of which there are few, and which a good start leaves out. Factors of a
  /// frequency nearby serve as long as few iterations are enough.
  class HarmonicSolver
  {
  public:
    /// Sector by sector where the equations keep to @p sectors. The equations must live longer.
    HarmonicSolver(const EquationsOfMotion &equations, const Sectors &sectors);
    /// Solves for each column of @p forces at @p omega > 0, 1/s; @p start is what is known of the
    /// solution. Throws SolverError, also if the backward error in the infinity norm is not below
    /// 1e-9. Collective.
    ComplexMultiVector solve(double omega, const MultiVector &forces,
                             const ComplexMultiVector &start);
    unsigned int n_factorizations() const
    {
      return n_factorizations_;
    }

  private:
    /// The last factors of a sector's A.
    struct Part
    {
      std::shared_ptr<const Factorization> factors;
      double factorised_at = 0; ///< 1/s
    };
    /// A matrix without entries, and its factor.
    struct Factored
    {
      std::complex<double> factor;
      Matrix matrix;
    };
    std::vector<std::vector<Term>> dynamic_stiffness(double omega) const;
    /// (A + i B + sum of @p dense) x = f of one sector; of all sectors the forces have
    /// @p largest_force.
    void solve(double omega, const Matrix &A, const Matrix &B, const std::vector<Factored> &dense,
               const MultiVector &forces, double largest_force, Part &part, ComplexMultiVector &x);

    const EquationsOfMotion &equations;
    const Sectors given;
    std::vector<Part> parts;
    unsigned int n_factorizations_ = 0;
  };

  /// H_jk(w) = e_j^T Q(i w)^{-1} f_k for some frequencies.
  struct FrequencyResponse
  {
    std::vector<double> frequencies; ///< Hz
    unsigned int n_forces = 0, n_observations = 0;
    std::vector<std::complex<double>> values;
    /// Errors of interpolation: a / (1 - q), a the largest difference of an interpolated value and
    /// a direct one of the last three direct solutions, which were not in the interpolation then,
    /// and q the factor by which they fall (divided by (s/s_f)^2 if s^2 R is interpolated, at the
    /// frequency f); zero if all are direct.
    std::vector<double> errors;
    unsigned int n_direct = 0, n_factorizations = 0;

    /// The place of values and errors.
    std::size_t at(const unsigned int frequency, const unsigned int force,
                   const unsigned int observation) const
    {
      return (std::size_t(frequency) * n_forces + force) * n_observations + observation;
    }
  };

  struct ResponseOptions
  {
    ResponseMethod method = ResponseMethod::modal;
    double tolerance      = 1e-4; ///< relative to the geometric mean of |H_jk| over direct values
    std::function<void(const std::string &)> progress = [](const std::string &) {};
  };

  /// The response at @p frequencies (Hz, ascending). modal: with right and left vectors
  /// (z^H Q'(l) x = 2 l) of the modes
  ///     H(s) = sum_k e^T x_k z_k^H f / ((s - l_k) 2 l_k)  +  the same of conj(l_k)  +  R(s),
  /// s = i w. R has no pole where all modes are known: it is interpolated by a polynomial of w
  /// among direct solutions at Leja points, as many as it takes until the error is within the
  /// tolerance; if bodies can move rigidly, s^2 R is. (With relaxation only the upper l_k are
  /// summed: f_b is not analytic across the real axis.) If interpolation takes as many direct
  /// solutions as there are frequencies, or more than 100, all are direct. What is below 1e-5 of
  /// the largest observation of a force need not be known better than that. Direct solutions are
  /// made sector by sector if the equations keep to @p sectors. Throws SolverError. Collective.
  FrequencyResponse frequency_response(const EquationsOfMotion &equations, const Sectors &sectors,
                                       const EigenPairs &modes, const MultiVector &forces,
                                       const MultiVector &observations,
                                       const std::vector<double> &frequencies,
                                       const ResponseOptions &options);
} // namespace squeal
