#pragma once

#include <squeal/mesh_files/deck_keywords.h>

#include <deal.II/base/point.h>

#include <array>
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
    std::string problem;             ///< why it cannot be used; matters where a section has it
    std::vector<std::string> unread; ///< other laws than *ELASTIC
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

  /// The system in which components of a set's nodes are given: X and Y, or of a cylinder.
  struct DeckTransform
  {
    std::string nodes;
    bool is_cylindrical = false;
    dealii::Tensor<1, 3> first, in_plane; ///< cylindrical: the axis, unused
    std::string where;
  };

  /// Friction and stiffness of surfaces that touch.
  struct DeckInteraction
  {
    std::vector<std::array<double, 3>> table; ///< coefficient, slip rate, pressure
    bool decays     = false; ///< from the coefficient to another one, exp(-decay v)
    double at_speed = 0, decay = 0;
    double stiffness = 0; ///< force over volume; 0: hard
    bool is_rough    = false;
    std::vector<std::string> problems; ///< why it is not read; matter where a contact has it
  };

  struct DeckPressure
  {
    std::string surface;
    double value;
    std::string where;
  };

  /// A force along a component at each node of a set, or at one node.
  struct DeckForce
  {
    std::string nodes;
    unsigned int component;
    double value;
    std::string where;
  };

  struct DeckContact
  {
    std::string first, second, interaction;
  };

  /// Some components of the displacement of a node set or a node.
  struct DeckSupport
  {
    std::string nodes;
    std::set<unsigned int> components; ///< none: only rotations
    std::string where;                 ///< file and line
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
    double position_tolerance = 0; ///< the smallest of the ties; 0: none is given
    std::vector<DeckContact> contacts;
    std::map<std::string, DeckInteraction> interactions;
    std::vector<DeckTransform> transforms;
    std::vector<DeckSupport> supports;
    std::vector<DeckPressure> pressures;
    std::vector<DeckForce> forces;
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
    /// What carries something and is not read, and what it carries.
    std::vector<std::pair<DeckMeaning, std::string>> not_read;
  };

  /// Reads keywords with their data, parts, instances and included files as well. Throws InputError
  /// with file and line.
  DeckModel read_deck_model(std::istream &in, const std::string &filename);
} // namespace squeal
