#include <squeal/parameters/declare.h>
#include <squeal/parameters/number_table.h>
#include <squeal/parameters/parameters.h>

#include <deal.II/base/utilities.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  namespace Parameters
  {

    void Refinement::declare(ParameterHandler &prm)
    {
      const Subsection section(prm, "Refinement");
      add_choice(prm, "Strategy", strategy,
                 "none: one mesh. uniform: every cell is refined from cycle to cycle. "
                 "adaptive: the cells that contribute most to the estimated errors of modes "
                 "whose error bar exceeds Tolerance (or whose verdict is undecided). A sweep "
                 "or map begins on the last mesh, made for the parameters as they stand.");
      prm.add_parameter("Cycles", cycles, "At most so many meshes.", Patterns::Integer(1, 100));
      prm.add_parameter("Contact edge levels", edge_levels,
                        "Before the first modes are sought, cells of the pads in which contact "
                        "ends, by the static equilibrium, are divided; so many times.",
                        Patterns::Integer(0, 8));
      prm.add_parameter("Tolerance", tolerance,
                        "Strategy adaptive: wanted relative error |d lambda|/|lambda| of every "
                        "mode in the window, "
                        "-; 0: only the verdicts decide.",
                        Patterns::Double(0));
      prm.add_parameter("Maximum unknowns", maximum_unknowns,
                        "A mesh with more unknowns is not begun.", Patterns::Integer(1));
      prm.add_parameter("Maximum time", maximum_time,
                        "A mesh that would end later than this after the start of the run, "
                        "predicted from the meshes before, is not begun, s; 0: no limit.",
                        Patterns::Double(0));
      prm.add_parameter("Maximum memory", maximum_memory,
                        "A mesh that would need more memory on all ranks together, predicted from "
                        "the meshes before, is not begun, GiB; 0: no limit.",
                        Patterns::Double(0));
      prm.add_parameter("Check memory", check_memory,
                        "End a run, or a refinement, before a mesh whose expected peak of memory "
                        "is more than what is available. false: the log tells the expected peak, "
                        "and the mesh is begun.");
      prm.add_parameter("Reference", reference,
                        "CSV file with the columns frequency_hz and growth_rate_1_per_s, one line "
                        "per mode: convergence.csv then has the true errors. Empty: none.");
    }

    void Refinement::check() const
    {
      reference_eigenvalues();
    }

    void All::check_edge_levels() const
    {
      const auto refuse = [this](const bool given, const std::string &why)
      {
        if (given)
          throw InputError("Refinement/Contact edge levels = " +
                           std::to_string(refinement.edge_levels) + ": " + why + " Allowed is 0.");
      };
      refuse(scene == Scene::matrices || n_pads() == 0, "there are no pads.");
      refuse(!contact.mortar(), "without contact pressures as unknowns quadrature points end the "
                                "contact inside of a cell; Contact/Formulation = mortar has them.");
      refuse(!contact.computes_pressure(), "no static equilibrium says where the pads touch.");
      refuse(varies_parameters(), "the edge moves in a sweep and between samples.");
    }

    std::vector<std::complex<double>> Refinement::reference_eigenvalues() const
    {
      std::vector<std::complex<double>> result;
      if (reference.empty())
        return result;
      const std::string key = "Refinement/Reference = " + reference;
      // Eigenvalues that are paired with modes: their distances are squared, and there is a table
      // of all of them.
      const NumberTableRules rules = {
          {"frequency_hz", "growth_rate_1_per_s"},
          {},
          "Needed are frequency_hz and growth_rate_1_per_s.",
          1e12,
          " is no eigenvalue of a brake; allowed are sizes up to 1e12.",
          2000,
          " modes; leave out those beyond Eigenproblem/Maximum frequency."};
      const NumberTable table = read_number_table(key, reference, rules);
      for (unsigned int i = 0; i < table.rows.size(); ++i)
      {
        const double frequency = table.rows[i][0];
        if (frequency < 0)
          throw InputError(table.places[i] +
                           text_of("frequency_hz = ", frequency, " is negative."));
        result.emplace_back(table.rows[i][1], 2 * M_PI * frequency);
      }
      if (result.empty())
        throw InputError(key + ": the file has no mode.");
      return result;
    }
  } // namespace Parameters
} // namespace squeal
