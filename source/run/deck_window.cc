#include <squeal/base/errors.h>
#include <squeal/base/log.h>
#include <squeal/eigen/inertia_count.h>
#include <squeal/model/brake_model.h>
#include <squeal/parameters/parameter_file.h>
#include <squeal/run/deck_window.h>
#include <squeal/scenes/make_scene.h>

#include <cmath>

namespace squeal
{
  double window_of_modes(const std::string &filename, const std::string &text,
                         const unsigned int n_modes)
  {
    ParameterFile file;
    file.read_text(filename, text);
    file.choose("Stage", "elastic");
    file.choose("Discretization/Degree", "1");
    const Parameters::All &prm = file.parameters();
    Log log(MPI_COMM_SELF);
    PhaseTimer timer;
    BrakeModel<3> model(make_scene<3>(prm), prm, MPI_COMM_SELF, log, timer);
    model.distribute();
    model.assemble(prm);
    const QuadraticEigenproblem problem = model.problem();
    const auto has_them                 = [&](const double frequency)
    { return count_reference_modes(problem, 2 * M_PI * frequency) >= n_modes; };
    // Between powers of two first, then to two per cent.
    constexpr double lowest = 1, highest = 1e7, precision = 1.02;
    double high = 512;
    while (high < highest && !has_them(high))
      high *= 2;
    if (high >= highest)
      throw InputError("--from-deck: the deck asks for " + std::to_string(n_modes) +
                       " modes; the brake has fewer on elements of degree 1. Ask for fewer, or for "
                       "frequencies.");
    while (high > lowest && has_them(high / 2))
      high /= 2;
    for (double low = high / 2; high / low > precision;)
    {
      const double middle             = std::sqrt(low * high);
      (has_them(middle) ? high : low) = middle;
    }
    const double unit = std::pow(10., std::floor(std::log10(high)) - 2);
    return unit * std::ceil(high / unit);
  }
} // namespace squeal
