#pragma once

#include <squeal/eigenproblem.h>

#include <complex>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace squeal
{
  /// Eigenvalues with Im l >= 0, ascending |Im l|, and their vectors x = re + i im, with u^H M u =
  /// 1 and the largest component of x turned to the real axis.
  struct Modes
  {
    std::vector<std::complex<double>> lambda;
    std::vector<double> backward_error;
    Block re, im;

    /// What the completeness check found, as a sentence for the log.
    std::string completeness;
    unsigned int n_rigid_body_modes = 0; ///< zero eigenvalues, not listed
    unsigned int n_solves           = 0;
    double factor_memory_mib        = 0;
  };

  struct EigensolverOptions
  {
    double max_imaginary = 0;    ///< every mode with 0 < |Im l| <= this is wanted, 1/s
    double tolerance     = 1e-9; ///< backward error, and relative change of the last polishing step
    double shift         = 0;    ///< relative to max_imaginary; 0: chosen

    /// Called with a line of progress.
    std::function<void(const std::string &)> progress = [](const std::string &) {};
  };

  /// Finds the modes of a quadratic eigenproblem in a window.
  class Eigensolver
  {
  public:
    virtual ~Eigensolver() = default;
    /// Throws SolverError if a mode of the window is missing or cannot be computed to the
    /// tolerance.
    virtual Modes solve(const QuadraticEigenproblem &problem,
                        const EigensolverOptions &options) const = 0;
  };

  /// The solver of that name: krylov or dense. To add one: a class and a row in the table.
  std::unique_ptr<Eigensolver> make_eigensolver(const std::string &name);

  /// The normwise backward error of approximate eigenpairs (Tisseur, 2000) in the infinity norm,
  ///     |Q(l) x| / ((|l|^2 |M| + |l| |P| + |Q|) |x|),
  /// the one measure for all solvers.
  class BackwardError
  {
  public:
    explicit BackwardError(const QuadraticEigenproblem &problem);

    /// Residuals Q(l_j) x_j (Re and Im) of the pairs and their backward errors.
    struct Result
    {
      Block re, im;
      std::vector<double> errors;
    };
    Result operator()(const std::vector<std::complex<double>> &lambda, const Block &re,
                      const Block &im) const;

  private:
    const QuadraticEigenproblem &problem;
    double norm_m, norm_p, norm_q;
  };
} // namespace squeal
