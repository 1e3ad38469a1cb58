#include <squeal/statics/static_report.h>

#include <cstdio>

namespace squeal
{
  std::string iteration_table(const std::vector<StaticIteration> &iterations, const bool mortar)
  {
    std::string text = std::string("Static equilibrium, active set:\n  step   active ") +
                       (mortar ? "multipliers" : "points     ") +
                       "   changes   tension, Pa   penetration, m   pressure change";
    const bool iterative = !iterations.empty() && iterations.front().n_linear > 0;
    text += iterative ? "   steps of GMRES\n" : "\n";
    for (unsigned int i = 0; i < iterations.size(); ++i)
    {
      char line[160];
      std::snprintf(line, sizeof(line), "  %4u   %18u   %7u   %11.3e   %14.3e   %15.3e", i,
                    iterations[i].n_active, iterations[i].n_changed, iterations[i].largest_tension,
                    iterations[i].largest_penetration, iterations[i].pressure_change);
      text += line;
      if (iterative)
      {
        std::snprintf(line, sizeof(line), "   %14u", iterations[i].n_linear);
        text += line;
      }
      text += "\n";
    }
    return text;
  }
} // namespace squeal
