#pragma once

#include <squeal/projection/eigenpairs.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <string>
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

    /// What may be so or not: effects that exclude each other.
    struct Alternatives
    {
      std::vector<Effect> effects;
      /// Whether the last one is the likeliest and belongs to the correction; the others lie on
      /// both sides of it. Else they are bounds of what may come to it.
      bool with_likeliest = false;
      std::string name    = {}; ///< what they are of: "edge of contact", ...
    };

    Effect f; ///< of one polynomial degree more
    /// The parts of F by kinds of cells, which may be seen in different shares. Cells are of one
    /// kind if they have the same material and lie at the same boundaries.
    std::vector<Effect> kinds;
    unsigned int degree = 1;
    std::vector<Alternatives> alternatives;

    unsigned int n_modes() const
    {
      return std::lround(std::sqrt(double(f.size())));
    }
    /// Sum over kinds of the moduli of their parts of Re F_jj.
    double growth_rate_parts(unsigned int mode) const;
  };

  /// What corrects the eigenvalues: one degree more, and the likeliest of alternatives.
  ErrorEffects::Effect correcting(const ErrorEffects &effects);

  /// The effects on some of the modes.
  ErrorEffects select(const ErrorEffects &effects, const std::vector<unsigned int> &members);

  /// Finds the effects on modes of the model as it is assembled now; modes are whole vectors.
  using ErrorEstimator = std::function<ErrorEffects(const Model &, const EigenPairs &)>;

  /// A part of the bars of a set of modes: how much one cause alone may change Re l and Im l, 1/s.
  struct BarPart
  {
    std::string cause;
    std::string at; ///< body or contact; empty: all of them
    std::vector<double> growth_rate, imaginary;

    /// Appends the next mode's.
    void add(const std::complex<double> &change)
    {
      growth_rate.push_back(std::abs(change.real()));
      imaginary.push_back(std::abs(change.imag()));
    }
  };

  struct ErrorBounds
  {
    /// What one polynomial degree more would change, coupling of the modes included: l_j plus this
    /// is the corrected value.
    std::vector<std::complex<double>> correction;
    /// Bounds of the whole error of Re l and Im l, 1/s.
    std::vector<double> growth_rate, imaginary;
    /// e, g and each group of alternatives below, then what is known of them by body and contact.
    std::vector<BarPart> parts;
  };

  /// Bounds of the discretisation's error from its first-order effects on the eigenvalues.
  ///
  /// One degree more does not see the whole error where the solution is singular: there the error
  /// of the eigenvalue falls like p^(-4a), r^a being the displacement, and a >= 1/2 at edges of
  /// contact and clamps. So the bounds take the part that is seen for 1 - (p/(p+1))^2 of the whole,
  /// with a margin of one fifth. Modes that are close to each other may have different parts: each
  /// one's is varied between what is seen and the whole, the others' held at either; and where two
  /// come closest as their effects grow together, the effects are taken as they are there. Call the
  /// largest change e.
  ///
  /// Parts of a growth rate cancel over the mesh. Kinds of cells, in the middle of a body, at a
  /// clamp, at the edge of a contact, may have different parts, too: by three tenths of the
  /// whole, which is g = 0.3 whole sum |Re F_kind| together. Of alternatives the larger change
  /// counts. Where one is the likeliest they are as much above as below: d, summed where there are
  /// several. Other alternatives' changes, b, come to all that. So the bound is
  ///     sqrt(e^2 + g^2 + d^2) + b,
  /// as for uncertainties that are independent.
  ///
  /// Modes of different @p parity (one for each mode, or empty) cannot couple: each parity has its
  /// own small matrix. An eigenvalue of it belongs to the mode that its vector is nearest to.
  ErrorBounds bound_errors(const std::vector<std::complex<double>> &lambda,
                           const std::vector<Parity> &parity, const ErrorEffects &effects);

  /// The whole of an effect that one degree more sees, with a margin: a factor.
  double whole_effect(unsigned int degree);

  /// By how much of the whole parts that are seen differ between kinds of cells.
  constexpr double unequal_parts = 0.3;

  /// The bound of bound_errors() for one number that effects change.
  class UncertainChange
  {
  public:
    /// One of the changes of which the largest is e.
    void include(const double change)
    {
      largest = std::max(largest, std::abs(change));
    }
    /// g
    void set_parts(const double change)
    {
      of_parts = change;
    }
    /// Adds the largest of the changes by some alternatives, which it returns, to d or b.
    double add(const ErrorEffects::Alternatives &alternatives, const std::vector<double> &changes);
    /// e
    double largest_change() const
    {
      return largest;
    }
    double bound() const
    {
      return std::sqrt(largest * largest + of_parts * of_parts + both_sides * both_sides) + at_most;
    }

  private:
    double largest = 0, of_parts = 0, both_sides = 0, at_most = 0;
  };
} // namespace squeal
