#pragma once

#include <squeal/mesh_files/deck_model.h>
#include <squeal/mesh_files/element_file.h>
#include <squeal/scenes/deck_parameters.h>

#include <array>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace squeal
{
  /// Numbers and lists as a parameter file has them.
  namespace deck_text
  {
    /// Prints a number with 15 digits.
    std::string digits(double value);
    /// Adds an item to a list with commas.
    void append(std::string &list, const std::string &item);
    /// Lists names, separated by commas.
    std::string list_of(const std::set<std::string> &names);
  } // namespace deck_text

  /// Joins what a deck says to its mesh: units, what turns, which contacts slide, the axis. Throws
  /// InputError for decks of which no brake can be made.
  class DeckAssembly
  {
  public:
    DeckAssembly(const ElementFile &mesh, DeckModel &&deck, const DeckOptions &options);

    /// Throws InputError that names the deck.
    [[noreturn]] void fail(const std::string &message) const;
    /// Notes what carries something and cannot be read.
    void leave_out(DeckMeaning meaning, const std::string &what);

    const std::vector<ElementFile::Face> &faces_of(const std::string &surface) const;
    /// Returns the sections that have a face.
    std::set<std::string> volumes_at(const ElementFile::Face &face) const;
    /// Returns the sections in which a surface is.
    std::set<std::string> volumes_of(const std::string &surface) const;
    double area_of(const std::string &surface) const;
    /// Returns the integral of the outward normal over a surface, and its centre.
    std::pair<dealii::Tensor<1, 3>, dealii::Point<3>>
    area_vector_of(const std::string &surface) const;
    double extent_of(const std::string &surface) const;
    /// Returns the nodes of the faces of a surface, those between the corners, too.
    std::set<unsigned int> nodes_on(const std::string &surface) const;
    const DeckInteraction &interaction_of(const DeckContact &contact) const;
    double friction_of(const DeckContact &contact) const;
    /// Returns the surface to which a coupling ties a node, or a set of one node; empty: none does.
    std::string coupled_surface(const std::string &node) const;
    /// Returns the coordinate of the parameter file that one of the deck becomes.
    unsigned int placed(unsigned int component) const;
    /// Prints a place of the deck in coordinates of the parameter file.
    std::string place_of(const dealii::Point<3> &x) const;

    const ElementFile &mesh;
    DeckModel deck;
    const DeckOptions options;
    /// What carries something and is left out.
    std::vector<std::pair<DeckMeaning, std::string>> unread;
    double length = 1;                 ///< metres of the deck's unit
    std::string units_doubt;           ///< a line that begins with "Warning", or nothing
    std::set<std::string> rotor, pads; ///< no rotor: parts are studied alone
    std::vector<DeckContact> pairs, joints;
    unsigned int axis = 0;
    bool axis_is_told = false;
    std::array<double, 3> origin{};

  private:
    /// A density below 1e-3 is in t/mm^3: solids have 1e-9 to 2e-8 of these, and more than 10
    /// kg/m^3. Without densities there are no modes.
    void choose_units();
    void doubt_units();
    void choose_rotor(const std::string &names);
    /// What slides on the rotor is a pad; other contacts are joints.
    void sort_contacts();
    /// Across the sliding surfaces, through the middle of the rotor.
    void choose_axis();
    /// Parts of two surfaces that slide on each other where one of them has several planes: both
    /// faces of the disc, or a skin over its rim. Each part of a pad touches that of the rotor
    /// which looks towards it and is nearest.
    void divide_pairs();
    /// Returns the direction across the sliding surfaces, as absolute values: of the rotor's, or
    /// where that has a rim, too, of the coordinate that most of the pads' surfaces lie across.
    dealii::Tensor<1, 3> across_sliding_surfaces() const;
    std::set<std::string> volumes() const;
    bool is_on_rotor(const std::string &surface) const;

    std::map<std::string, std::vector<ElementFile::Face>> parts_of_surfaces; ///< by planes
    std::map<ElementFile::Face, unsigned int> element_of_face;
  };
} // namespace squeal
