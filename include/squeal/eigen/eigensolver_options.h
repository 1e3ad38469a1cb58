#pragma once

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
    /// The number of reference modes in the disc (Eigensolver::counts_in_disc()), if others count
    /// them: called after the factorisation. Free bodies are not allowed with it.
    std::function<unsigned int()> counted_elsewhere;

    /// Called with a line of progress.
    std::function<void(const std::string &)> progress = [](const std::string &) {};
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
} // namespace squeal
