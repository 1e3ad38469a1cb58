#pragma once

#include <squeal/equations/eigenproblem.h>
#include <squeal/equations/parity.h>
#include <squeal/linalg/complex_multi_vector.h>
#include <squeal/linalg/factorization.h>
#include <squeal/projection/eigensolver_options.h>

#include <complex>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace squeal
{
  /// Eigenvalues with Im l >= 0, their vectors, and how accurate they are. What a solver does not
  /// compute is empty.
  struct EigenPairs
  {
    std::vector<std::complex<double>> lambda;
    ComplexMultiVector right; ///< Q(l) x = 0
    ComplexMultiVector left;  ///< z^H Q(l) = 0
    std::vector<double> backward_error, left_backward_error;
    /// |z|_M |x|_M |2 l| / |z^H Q'(l) x|: 1 for a conservative system, infinite at coalescence. A
    /// perturbation dQ of the operator moves l by at most condition |dQ| / |2 l|, |dQ| in the norm
    /// of M, to first order.
    std::vector<double> condition;
    /// What a projection may have moved l by, where there was one, relative to |l| and to the
    /// condition.
    std::vector<double> projection_error;
    std::vector<Parity> parity;

    unsigned int size() const
    {
      return lambda.size();
    }
    bool empty() const
    {
      return lambda.empty();
    }
    /// The pairs of the given numbers, in their order, with all that is known of them.
    EigenPairs select(const std::vector<unsigned int> &numbers) const;
    /// Appends others, of which the same must be known, and vectors in the same rows.
    void append(const EigenPairs &others);
  };

  /// What an eigensolver gives back.
  struct EigenSolution
  {
    /// The modes of the window by ascending |Im l|, u^H M u = 1, the largest component of x turned
    /// to the real axis, |z^H Q'(l) x| = |2 l|.
    EigenPairs modes;

    /// What shows that no mode is missing.
    struct Proof
    {
      std::string completeness;            ///< what the check found, as a sentence for the log
      unsigned int n_reference        = 0; ///< modes of the reference problem in the region
      unsigned int n_rigid_body_modes = 0; ///< zero eigenvalues, not listed
      /// All eigenvalues with Im l >= 0 that were found, those of the window and others.
      std::vector<std::complex<double>> eigenvalues;
      /// What is known of modes of the window that grow outside of the region, as a sentence for
      /// the log; empty: nothing.
      std::string beyond;
      /// Whether there are such modes that were not found: then more grow than are listed.
      bool lacks_growing = false;
      /// Ritz values outside of the region that are nearly converged.
      std::vector<std::complex<double>> ritz_values_beyond;
    } proof;

    struct Cost
    {
      unsigned int n_solves    = 0; ///< right-hand sides
      double factor_memory_mib = 0, predicted_memory_mib = 0;
      /// Processor seconds of this rank.
      struct Seconds
      {
        double counting = 0, factorization = 0, right = 0, left = 0;
      } seconds;
    } cost;

    /// For problems nearby, on demand and if the solver has it (keep_factors).
    struct Reuse
    {
      MultiVector disc_right, disc_left; ///< vectors of all modes of the disc, [Re, Im]
      MultiVector search_space; ///< a basis of the space in which the right ones were found
      std::shared_ptr<const Factorization> factorization; ///< of Q
      unsigned int n_reference = 0;                       ///< as in the proof
      std::vector<std::complex<double>> disc_lambda;      ///< all eigenvalues of the disc
      /// By what factor forces may change before a mode that is strongly damped or grows strongly
      /// can come into the disc from outside: clearance_of().
      double clearance = 1;
      /// Whether modes of the window that grow outside of the disc were looked for without a sign
      /// of one: else the vectors of the disc lack them.
      bool has_no_growth_beyond = false;
      /// The tracker's count of assemblies when these were computed.
      unsigned int assembly = 0;
      /// If the modes were found sector by sector: those of the sectors, in their own vectors.
      std::vector<std::shared_ptr<const EigenSolution>> sectors;

      bool empty() const
      {
        return !factorization && sectors.empty();
      }
    } reuse;
  };

  /// What a run says where proof.lacks_growing.
  constexpr const char *lacking_growth =
      "Warning, more modes grow than are listed: there are signs of growth outside of the region "
      "that was searched. The steady state is unstable.";

  /// The order of modes: by |Im l|, then by Re l.
  inline bool precedes(const std::complex<double> &a, const std::complex<double> &b)
  {
    return std::make_pair(a.imag(), a.real()) < std::make_pair(b.imag(), b.real());
  }
  /// The numbers of eigenvalues in the order of modes.
  std::vector<unsigned int> order_of_modes(const std::vector<std::complex<double>> &lambda);

  /// For each eigenvalue the number of the nearest of the others that is not taken; fewer if there
  /// are not enough.
  std::vector<unsigned int> nearest_partners(const std::vector<std::complex<double>> &lambda,
                                             const std::vector<std::complex<double>> &others);

  /// The largest relative change of an eigenvalue; 1 if their number has changed.
  double largest_change(const std::vector<std::complex<double>> &lambda,
                        const std::vector<std::complex<double>> &previous);

  /// The two-sided Rayleigh corrections of eigenvalues, z^H Q(l) x / z^H Q'(l) x, term by term from
  /// the forms z_j^H A x_j: l minus this is right to the product of the vectors' errors.
  class RayleighCorrections
  {
  public:
    explicit RayleighCorrections(const std::vector<std::complex<double>> &eigenvalues)
        : lambda(eigenvalues), residuals(eigenvalues.size()), slopes(eigenvalues.size())
    {
    }
    /// Adds coefficient l^order A.
    void add(unsigned int order, double coefficient,
             const std::vector<std::complex<double>> &forms);
    /// Adds h(l) A.
    void add(const FrozenTerm &term, const std::vector<std::complex<double>> &forms);
    std::vector<std::complex<double>> values() const;

  private:
    std::vector<std::complex<double>> lambda, residuals, slopes;
  };

  /// Z^H [(l_i + l'_j) M + P] X of the left vectors of some pairs and the right ones of others, the
  /// form in which those of different eigenvalues are orthogonal: z_i^H Q(l_i) = 0 and Q(l'_j) x_j
  /// = 0 give (l_i - l'_j) z_i^H [...] x_j = 0. On the diagonal it is z^H Q'(l) x. Frozen terms add
  /// their difference quotients. Column-major.
  std::vector<std::complex<double>> biorthogonality(const QuadraticEigenproblem &problem,
                                                    const EigenPairs &of_left,
                                                    const EigenPairs &of_right);

  /// Makes x^H M x = 1 with the largest component real and z^H Q'(l) x = 2 l, and computes the
  /// condition numbers.
  void normalise(const QuadraticEigenproblem &problem, EigenPairs &modes);

  /// Turns the largest component of each vector to the real axis; x and z stay normalised.
  void turn_to_real(EigenPairs &modes);
} // namespace squeal
