#pragma once

#include <deal.II/base/point.h>

#include <istream>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace squeal
{
  struct DeckMaterial
  {
    std::vector<double> elastic; ///< E, nu or the nine engineering constants
    double density = 0, mass_damping = 0, stiffness_damping = 0, loss_factor = 0;
    std::string problem; ///< why it cannot be used; matters where a section has it
  };

  struct DeckSection
  {
    std::string volume, material, orientation;
  };

  /// The first direction, and a vector in the plane of the first and the second one.
  struct DeckOrientation
  {
    dealii::Tensor<1, 3> first, in_plane;
  };

  struct DeckContact
  {
    std::string first, second, interaction;
  };

  /// Some components of the displacement of a node set or a node.
  struct DeckSupport
  {
    std::string nodes;
    std::set<unsigned int> components;
    std::string where; ///< file and line
  };

  /// Springs, dashpots or masses of the elements of a set.
  struct DeckLumped
  {
    std::string kind, elements;
    std::vector<std::vector<double>> rows; ///< the fields that are not empty
    std::string where;
  };

  struct DeckLumpedElement
  {
    std::string type;
    std::vector<std::string> nodes;
  };

  /// What a deck of Abaqus or CalculiX says beside its mesh, in its own units and labels; it knows
  /// no parameters of squeal.
  struct DeckModel
  {
    std::map<std::string, DeckMaterial> materials;
    std::vector<DeckSection> sections;
    std::map<std::string, DeckOrientation> orientations;
    std::vector<std::pair<std::string, std::string>> ties;
    std::vector<DeckContact> contacts;
    std::map<std::string, double> friction; ///< by interaction
    std::vector<DeckSupport> supports;
    std::vector<std::pair<std::string, double>> pressures;
    std::map<std::string, std::vector<DeckLumpedElement>> lumped_elements; ///< by set
    std::vector<DeckLumped> lumped;
    std::map<std::string, std::string> surface_of_node; ///< couplings: reference node, surface
    std::map<std::string, std::string> node_of_set;     ///< sets of one node, outside of parts
    std::map<std::string, dealii::Point<3>> nodes;      ///< outside of parts, by number
    double speed = 0, frequency = 0, lowest_frequency = 0;
    bool speed_is_told = false;
    double n_modes     = 0;   ///< that are asked for; 0: no number is
    std::vector<double> axis; ///< two points
    std::vector<std::string> passed_over;
  };

  /// Reads keywords with their data, parts, instances and included files as well. Throws InputError
  /// with file and line.
  DeckModel read_deck_model(std::istream &in, const std::string &filename);
} // namespace squeal
