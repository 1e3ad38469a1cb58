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
    // What changed since the step before is no residual: a reader takes 4e-01 for one.
    if (!iterations.empty() && iterations.back().n_changed == 0)
      text += "  No contact changes any more: for these contacts the equations are solved. The "
              "pressure changed since the step before, whose contacts were others.\n";
    return text;
  }
} // namespace squeal
