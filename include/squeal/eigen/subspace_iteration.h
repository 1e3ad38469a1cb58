#pragma once

#include <squeal/eigen/eigenproblem.h>

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
    MultiVector re, im;

    /// Left vectors z = left_re + i left_im, z^H Q(l) = 0, scaled to |z^H Q'(l) x| = |2 l|, and
    /// their backward errors.
    MultiVector left_re, left_im;
    std::vector<double> left_backward_error;
    /// |z|_M |x|_M |2 l| / |z^H Q'(l) x|: 1 for a conservative system, infinite at coalescence. A
    /// perturbation dQ of the operator moves l by at most condition |dQ| / |2 l|, |dQ| in the norm
    /// of M, to first order.
    std::vector<double> condition;
    /// Whether the mode is symmetric or antisymmetric about the rotor's mid-plane; empty: not
    /// known.
    std::vector<std::string> mirror;

    /// All eigenvalues of the searched disc, of which the window is a part.
    std::vector<std::complex<double>> disc_lambda;
    /// On demand and if the solver has them (keep_factors): right and left vectors of all modes of
    /// the disc, Re then Im, a basis of the space in which the right ones were found, and the
    /// factors of Q.
    MultiVector disc_right, disc_left, search_space;
    std::shared_ptr<const Factorization> factorization;
    /// With keep_factors, if the modes were found by symmetric and antisymmetric halves: these, in
    /// vectors of the halves.
    std::vector<std::shared_ptr<const Modes>> halves;

    /// What the completeness check found, as a sentence for the log.
    std::string completeness;
    unsigned int n_reference        = 0; ///< modes of the reference problem in the searched disc
    unsigned int n_rigid_body_modes = 0; ///< zero eigenvalues, not listed
    unsigned int n_solves           = 0; ///< right-hand sides
    double factor_memory_mib = 0, predicted_memory_mib = 0;

    /// Processor seconds of this rank.
    struct Seconds
    {
      double counting = 0, factorization = 0, right = 0, left = 0;
    } seconds;
  };

  struct EigensolverOptions
  {
    double max_imaginary = 0;    ///< every mode with 0 < |Im l| <= this is wanted, 1/s
    double min_imaginary = 0;    ///< 0, or only those with |Im l| >= this
    double tolerance     = 1e-9; ///< backward error, and relative change of the last polishing step
    double shift         = 0;    ///< relative to max_imaginary; 0: chosen
    bool keep_factors    = false; ///< for problems nearby
    /// The number of reference modes in the disc (Eigensolver::counts_in_disc()), if others count
    /// them: called after the factorisation. Free bodies are not allowed with it.
    std::function<unsigned int()> counted_elsewhere;

    /// Called with a line of progress.
    std::function<void(const std::string &)> progress = [](const std::string &) {};
  };

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
      MultiVector re, im;
      std::vector<double> errors;
    };
    Result operator()(const std::vector<std::complex<double>> &lambda, const MultiVector &re,
                      const MultiVector &im) const;

    /// The residuals alone.
    Result residuals(const std::vector<std::complex<double>> &lambda, const MultiVector &re,
                     const MultiVector &im) const;
    /// The errors of given residuals.
    std::vector<double> errors(const std::vector<std::complex<double>> &lambda,
                               const Result &residuals, const MultiVector &re,
                               const MultiVector &im) const;

  private:
    const QuadraticEigenproblem &problem;
    double norm_m, norm_p, norm_q;
  };

  /// Solves with a factorisation of F = Q(s) at a real shift s, or of F = Q + t M, a shift of l^2
  /// by t in which the velocity terms are left out (t = -w^2 reaches modes near i w in real
  /// arithmetic); or of its transpose for the adjoint problem. In both cases
  ///     Q(l) = F + (l^2 - square) M + (l - shift) P.
  class ShiftInvert
  {
  public:
    ShiftInvert(const Factorization &factorization, const double shift, const bool adjoint = false)
        : shift(shift), square(shift * shift), factorization(factorization), adjoint(adjoint)
    {
    }
    /// Q + square M.
    static ShiftInvert of_square(const Factorization &factorization, const double square,
                                 const bool adjoint = false)
    {
      return ShiftInvert(factorization, 0, square, adjoint);
    }
    MultiVector solve(const MultiVector &b) const
    {
      return adjoint ? factorization.solve_transposed(b) : factorization.solve(b);
    }
    MultiVector solve_transposed(const MultiVector &b) const
    {
      return adjoint ? factorization.solve(b) : factorization.solve_transposed(b);
    }
    const double shift, square;

  private:
    ShiftInvert(const Factorization &factorization, const double shift, const double square,
                const bool adjoint)
        : shift(shift), square(square), factorization(factorization), adjoint(adjoint)
    {
    }
    const Factorization &factorization;
    const bool adjoint;
  };

  /// Approximate eigenpairs that span a real subspace.
  struct Pairs
  {
    std::vector<std::complex<double>> lambda;
    MultiVector re, im;
  };

  /// A zero eigenvalue of a body that is free to move is defective, so rounding spreads it to
  /// sqrt(eps): eigenvalues below this count as zero.
  inline double rigid_body_limit(const double max_imaginary)
  {
    return 1e-5 * max_imaginary;
  }

  /// |l| up to which solvers search: the window is a strip |Im l| <= w, the search region this
  /// disc. A mode of the strip outside of it has a damping ratio above 0.4 and cannot squeal.
  inline double search_radius(const double max_imaginary)
  {
    return 1.1 * max_imaginary;
  }

  /// For each eigenvalue the number of the nearest of the others that is not taken; fewer if there
  /// are not enough.
  std::vector<unsigned int> nearest_partners(const std::vector<std::complex<double>> &lambda,
                                             const std::vector<std::complex<double>> &others);

  /// The largest relative change of an eigenvalue; 1 if their number has changed.
  double largest_change(const std::vector<std::complex<double>> &lambda,
                        const std::vector<std::complex<double>> &previous);

  /// Rayleigh-Ritz on the span of an orthonormal real basis U, tested with Z: all Ritz pairs
  ///     (l^2 Z^T M U + l Z^T P U + Z^T Q U) c = 0,   x = U c,
  /// with Im l >= 0 and |l| <= radius.
  Pairs rayleigh_ritz(const QuadraticEigenproblem &problem, const MultiVector &trial,
                      const MultiVector &test, double radius, double shift);

  /// The pairs of the given numbers.
  Pairs select(const Pairs &pairs, const std::vector<unsigned int> &numbers);

  /// One step of inverse iteration with the factorisation F at the shift s:
  ///     x := -F^{-1} ((l^2 - s^2) M + (l - s) P) x  =  x - F^{-1} Q(l) x.
  /// It damps what is far outside of the window, and gives multipliers that belong to the
  /// displacements.
  void inverse_iteration(const QuadraticEigenproblem &problem, const ShiftInvert &shift_invert,
                         Pairs &pairs);

  /// Sets the contact pressures to zero.
  void clear_pressures(unsigned int n_local_constraints, MultiVector &block);

  /// Numbers in [-1, 1] that depend on row, column and seed, not on the number of ranks.
  MultiVector scattered_numbers(const RowRange &rows, unsigned int n_columns, unsigned int seed);

  /// An orthonormal basis of what the block adds to the span of an orthonormal basis.
  MultiVector orthonormal_complement(const MultiVector &basis, MultiVector block);

  /// Improves approximate eigenvectors until their backward errors and the last relative changes
  /// of their eigenvalues are below the tolerance. Each step is Rayleigh-Ritz and one inverse
  /// iteration, whose result enlarges the next subspace: block Davidson with the factorisation at
  /// the shift as preconditioner, in real arithmetic.
  ///
  /// The displacements satisfy N^T u = 0, and test vectors must satisfy (N + mu T)^T z = 0 for
  /// the contact pressures to drop out. U does so neither with friction nor, after
  /// orthonormalisation of almost dependent columns, to rounding; Z = Q(s)^{-T} M U does, and is
  /// smooth.
  ///
  /// @p start spans the approximate vectors, @p previous holds their eigenvalues inside the
  /// radius. Ritz values without a small residual are no eigenvalues and are left out; fewer
  /// pairs than given are a SolverError. If the eigenvalues are @p known, exactly theirs are looked
  /// for.
  Modes polish(const QuadraticEigenproblem &problem, const ShiftInvert &shift_invert,
               MultiVector start, std::vector<std::complex<double>> previous, double radius,
               bool known, const EigensolverOptions &options);

  /// An orthonormal basis of the block Krylov space of Q(s)^{-1} M from a fixed start block. The
  /// velocity terms, weak in a brake, are left to polish(). Multipliers are cleared.
  MultiVector krylov_basis(const QuadraticEigenproblem &problem, const ShiftInvert &shift_invert,
                           unsigned int n_columns, unsigned int seed);

  /// Z^H A X for blocks of complex vectors, column-major, the same on all ranks.
  std::vector<std::complex<double>> sesquilinear_form(const MultiVector &z_re,
                                                      const MultiVector &z_im, const Matrix &matrix,
                                                      const MultiVector &x_re,
                                                      const MultiVector &x_im);

  /// Z^H [(l_i + l'_j) M + P] X, the form in which left and right vectors of different eigenvalues
  /// are orthogonal: z_i^H Q(l_i) = 0 and Q(l'_j) x_j = 0 give (l_i - l'_j) z_i^H [...] x_j = 0. On
  /// the diagonal it is z^H Q'(l) x. Column-major.
  std::vector<std::complex<double>>
  biorthogonality(const QuadraticEigenproblem &problem,
                  const std::vector<std::complex<double>> &lambda_z, const MultiVector &z_re,
                  const MultiVector &z_im, const std::vector<std::complex<double>> &lambda_x,
                  const MultiVector &x_re, const MultiVector &x_im);
} // namespace squeal
