#pragma once

#include <cmath>
#include <complex>
#include <functional>
#include <string>

namespace squeal
{
  struct EigensolverOptions
  {
    double max_imaginary = 0;     ///< every mode with 0 < |Im l| <= this is wanted, 1/s
    double min_imaginary = 0;     ///< 0, or only those with |Im l| >= this
    double tolerance     = 1e-9;  ///< backward error, and relative change of the last refinement
    double shift         = 0;     ///< relative to max_imaginary; 0: chosen
    bool keep_factors    = false; ///< for problems nearby
    /// Whether modes of the window that grow outside of the disc are looked for, too.
    bool looks_beyond_disc = true;
    /// Called with a line of progress.
    std::function<void(const std::string &)> progress = [](const std::string &) {};
  };

  /// A zero eigenvalue of a body that is free to move is defective, so rounding spreads it to
  /// sqrt(eps): eigenvalues below this count as zero.
  inline double rigid_body_limit(const double max_imaginary)
  {
    return 1e-5 * max_imaginary;
  }

  /// Whether an eigenvalue is real up to rounding. (Overdamped modes of a body with the stiffness
  /// proportional damping beta crowd at -1/beta: rounding makes complex pairs of them, with |Im l|
  /// of 1e-9 |l| and less.)
  inline bool is_nearly_real(const std::complex<double> &l)
  {
    return std::abs(l.imag()) <= 1e-7 * std::abs(l);
  }

  /// Whether it says nothing about stability: an overdamped mode, which does not oscillate.
  inline bool is_overdamped(const std::complex<double> &l)
  {
    return l.real() < 0 && is_nearly_real(l);
  }

  /// An eigenvalue of the order of a window's end is known to this part of it: on the end is
  /// inside.
  constexpr double rounding_of_window = 1e-10;

  /// |l| up to which solvers search: the window is a strip |Im l| <= w, the search region this
  /// disc. A mode of the strip outside of it decays with a damping ratio above 0.4 and cannot
  /// squeal, or grows: see growth_search.h.
  inline double search_radius(const double max_imaginary)
  {
    return 1.1 * max_imaginary;
  }
} // namespace squeal
