#include <squeal/base/memory.h>
#include <squeal/run/memory_prediction.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  double expected_number_of_modes(const Parameters::All &parameters)
  {
    const Parameters::Eigenproblem &window = parameters.eigenproblem;
    const Parameters::Rotor &rotor         = parameters.rotor;
    const Material &material               = rotor.material;
    // Bending modes of a plate of area A and thickness h below f: sqrt(3) A f / (c h) (Courant and
    // Hilbert), c^2 = E / rho (1 - nu^2). In-plane modes and pads make it 1.67 times as many.
    const double area = M_PI * (std::pow(rotor.outer_radius, 2) - std::pow(rotor.inner_radius, 2)),
                 c    = std::sqrt(material.young_modulus /
                                  (material.density * (1 - std::pow(material.poisson_ratio, 2))));
    return 1.67 * std::sqrt(3.) * area * (window.maximum_frequency - window.minimum_frequency) /
           (c * rotor.thickness);
  }

  double expected_peak_mib(const RunSize &size)
  {
    constexpr double libraries = 196, mib = sizeof(double) * 1e-6;
    // Functions of a cell in the space of displacements and in that of the error bars.
    const double n = 3 * std::pow(size.degree + 1, 3), n_bars = 3 * std::pow(size.degree + 2, 3);
    double peak = size.n_ranks * libraries + 38.7 * mib * size.n_unknowns * size.n_modes +
                  2.77 * mib * size.n_cells * n * n;
    if (size.error_bars)
      peak += 0.095 * size.n_cells + 2.73 * mib * size.n_cells * size.n_modes * n_bars;
    return peak;
  }

  double expected_memory_load(const RunSize &size, const MPI_Comm comm)
  {
    constexpr double largest_error = 1.25;
    const double more = expected_peak_mib(size) / largest_error - peak_memory_mib(comm);
    return memory_load(std::max(0., more) / size.n_ranks, comm);
  }
} // namespace squeal
