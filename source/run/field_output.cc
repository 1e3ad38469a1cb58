#include <squeal/contact/contact_fields.h>
#include <squeal/mesh/fields.h>
#include <squeal/run/field_output.h>

namespace squeal
{
  namespace
  {
    std::vector<unsigned int> wanted_modes(const std::vector<ModeRow> &rows,
                                           const FieldOutput output)
    {
      std::vector<unsigned int> wanted;
      for (unsigned int j = 0; j < rows.size(); ++j)
        if (output == FieldOutput::all || rows[j].is_unstable() ||
            rows[j].verdict == Verdict::undecided)
          wanted.push_back(j);
      if (wanted.empty() && !rows.empty())
        wanted.push_back(least_stable(rows));
      return wanted;
    }
  } // namespace

  template <int dim>
  void write_fields(const BrakeModel<dim> &model, const EigenPairs &modes,
                    const std::vector<ModeRow> &rows, const std::string &directory,
                    const unsigned int cycle, Log &log)
  {
    const Parameters::All &prm            = model.parameters();
    const FiniteElementSpace<dim> &spaces = model.spaces();
    const SteadyState<dim> &state         = model.steady_state();
    const bool has_contact = prm.has_contact(), slides = prm.terms().friction;
    const double pressure_scale = has_contact ? state.contact->pressure_scale() : 1;
    if (state.equilibrium)
    {
      const MultiVector &displacements = state.equilibrium->state;
      write_state(spaces, displacements, pressure_scale, directory, cycle);
      if (has_contact)
        write_contact(spaces, *state.contact, displacements, slides, directory, cycle);
    }
    else if (state.worn)
      write_contact<dim>(
          spaces, *state.contact,
          [&](const unsigned int pad, const dealii::Point<dim> &x,
              const dealii::Tensor<1, dim> &normal)
          { return state.worn->at(spaces.geometry, pad, x, normal); },
          slides, directory, cycle);
    // A hundred undecided modes need no hundred animations.
    const auto moves = [&](const unsigned int j)
    {
      return prm.output.fields == FieldOutput::all || rows[j].is_unstable() ||
             j == least_stable(rows);
    };
    for (const unsigned int j : wanted_modes(rows, prm.output.fields))
    {
      log.progress("  fields of mode " + std::to_string(rows[j].mode));
      write_mode(spaces, modes.right, j, pressure_scale, directory, cycle, rows[j].mode,
                 moves(j) ? prm.output.animation_frames : 0);
      if (slides && prm.n_pads() > 0)
        write_friction_work(spaces, *state.contact, model.friction_work(modes, j), directory, cycle,
                            rows[j].mode);
    }
  }

  template void write_fields(const BrakeModel<2> &, const EigenPairs &,
                             const std::vector<ModeRow> &, const std::string &, unsigned int,
                             Log &);
  template void write_fields(const BrakeModel<3> &, const EigenPairs &,
                             const std::vector<ModeRow> &, const std::string &, unsigned int,
                             Log &);
} // namespace squeal
