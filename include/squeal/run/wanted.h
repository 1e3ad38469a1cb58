#pragma once

#include <squeal/parameters/parameters.h>

namespace squeal
{
  /// What a run is asked for. The steady state always is, where bodies are meshed.
  struct Wanted
  {
    explicit Wanted(const Parameters::All &prm)
        : modes(prm.eigenproblem.is_solved()), bars(modes && prm.eigenproblem.error_bars),
          self_locking(prm.terms().friction && prm.contact.self_locking_check && prm.n_pads() > 0),
          fields(prm.output.fields != FieldOutput::none), response(prm.response.active()),
          matrices(prm.output.matrices),
          studies(prm.varies_parameters() || prm.stage == Stage::ladder),
          meshes(prm.refinement.n_cycles() > 1 || !studies), equations(modes || response)
    {
    }

    const bool modes, bars;  ///< and what the mesh does to their eigenvalues
    const bool self_locking; ///< the gain of friction on the contact pressure
    const bool fields;
    const bool response; ///< to forces, by frequency
    const bool matrices; ///< for other programs
    const bool studies;  ///< a sweep, a map, samples or the ladder, on the last mesh
    const bool meshes; ///< modes on a sequence of meshes: studies need none, but make no mesh finer
    const bool equations; ///< about the steady state
  };
} // namespace squeal
