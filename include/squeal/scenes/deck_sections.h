#pragma once

#include <squeal/scenes/deck_assembly.h>

#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace squeal
{
  /// A line of a parameter file: set key = value  # comment. No value: no line.
  struct DeckSetting
  {
    std::string key, value, comment = "";
  };

  /// Names the law of a section's material.
  struct DeckLaw
  {
    std::string material, orientation;
    bool operator<(const DeckLaw &other) const
    {
      return std::tie(material, orientation) < std::tie(other.material, other.orientation);
    }
  };

  /// Prints the lines of a subsection Material.
  std::string deck_material(const DeckAssembly &all, const DeckLaw &law, const std::string &indent);

  /// Returns the supports of the section Mesh. What no face holds is left out.
  std::vector<DeckSetting> deck_supports(DeckAssembly &all);

  struct DeckLoads
  {
    double pads_pressure = 0;         ///< Pads/Pressure, Pa; 0: the deck gives none
    std::vector<DeckSetting> of_mesh; ///< of the section Mesh
  };
  /// Returns the pressures of *DSLOAD, *DLOAD, and of forces that are resultants of pressures.
  /// Other loads are left out.
  DeckLoads deck_loads(DeckAssembly &all);

  /// Returns the section Joints: ties, contacts that do not slide, springs, dashpots and masses.
  std::vector<DeckSetting> deck_joints(DeckAssembly &all);

  /// Notes friction and stiffness of contacts that cannot be read.
  void check_interactions(DeckAssembly &all);
  /// Prints the section Contact of the pairs that slide.
  std::string deck_friction(const DeckAssembly &all);
} // namespace squeal
