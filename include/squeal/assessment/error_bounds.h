#pragma once

#include <squeal/eigen/eigenpairs.h>

#include <complex>
#include <functional>
#include <vector>

namespace squeal
{
  class Model;

  /// First-order effects of the discretisation on a set of eigenvalues, each column-major and as
  /// large as the number of modes squared: the eigenvalues of diag(l_i) + F are those that the
  /// effect F makes. Bounds are made of them.
  struct ErrorEffects
  {
    using Effect = std::vector<std::complex<double>>;

    Effect f; ///< of one polynomial degree more
    /// Sums of the moduli of the cells' parts of Re F_jj.
    std::vector<double> growth_rate_parts;
    unsigned int degree = 1;
    /// Effects that may be so or not: of each group of them, which exclude each other, the larger
    /// change is added. They belong to no correction, but for the third of a group of three: it is
    /// the likeliest, and the others lie on both sides of it.
    std::vector<std::vector<Effect>> alternatives;
  };

  /// What corrects the eigenvalues: one degree more, and the likeliest of alternatives.
  ErrorEffects::Effect correcting(const ErrorEffects &effects);

  /// The effects on some of the modes.
  ErrorEffects select(const ErrorEffects &effects, const std::vector<unsigned int> &members);

  /// Finds the effects on modes of the model as it is assembled now; modes are whole vectors.
  using ErrorEstimator = std::function<ErrorEffects(const Model &, const EigenPairs &)>;

  struct ErrorBounds
  {
    /// What one polynomial degree more would change, coupling of the modes included: l_j plus this
    /// is the corrected value.
    std::vector<std::complex<double>> correction;
    /// Bounds of the whole error of Re l and Im l, 1/s.
    std::vector<double> growth_rate, imaginary;
  };

  /// Bounds of the discretisation's error from its first-order effects on the eigenvalues.
  ///
  /// One degree more does not see the whole error where the solution is singular: there the error
  /// of the eigenvalue falls like p^(-4a), r^a being the displacement, and a >= 1/2 at edges of
  /// contact and clamps. So the bounds take the part that is seen for 1 - (p/(p+1))^2 of the whole,
  /// with a margin of one fifth. Modes that are close to each other may have different parts: each
  /// one's is varied between what is seen and the whole, the others' held at either; and where two
  /// come closest as their effects grow together, the effects are taken as they are there. Parts of
  /// a growth rate cancel over the mesh; a fiftieth of their moduli is added for those that are not
  /// seen and may cancel less.
  ///
  /// Modes of different @p parity (one for each mode, or empty) cannot couple: each parity has its
  /// own small matrix. An eigenvalue of it belongs to the mode that its vector is nearest to.
  ErrorBounds bound_errors(const std::vector<std::complex<double>> &lambda,
                           const std::vector<Parity> &parity, const ErrorEffects &effects);

  /// The whole of an effect that one degree more sees, with a margin: a factor.
  double whole_effect(unsigned int degree);
} // namespace squeal
