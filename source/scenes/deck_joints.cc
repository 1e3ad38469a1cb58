#include <squeal/scenes/deck_sections.h>

#include <algorithm>
#include <optional>

namespace squeal
{
  using namespace dealii;
  using namespace deck_text;

  namespace
  {
    /// Ties, contacts that do not slide, and springs, dashpots, masses of points.
    class DeckJoints
    {
    public:
      explicit DeckJoints(DeckAssembly &all) : all(all) {}

      std::vector<DeckSetting> settings()
      {
        std::string ties, contacts;
        for (auto [first, second] : all.deck.ties)
        {
          // The first surface lies on the second.
          if (all.area_of(first) > 1.0001 * all.area_of(second))
            std::swap(first, second);
          append(ties, first + " : " + second);
        }
        for (const DeckContact &contact : all.joints)
          append(contacts,
                 contact.first + " : " + contact.second +
                     (all.friction_of(contact) > 0 ? " : stick " + digits(all.friction_of(contact))
                      : all.interaction_of(contact).is_rough ? " : stick"
                                                             : " : frictionless"));
        for (const DeckLumped &lumped : all.deck.lumped)
          add_lumped(lumped);
        std::string points;
        for (const auto &[name, place] : points_used)
          append(points, name + " : " + place);
        if (ties.empty() && contacts.empty() && points.empty())
          return {};
        // Default: what a run takes, which depends on the mesh
        const std::string tolerance =
            all.deck.position_tolerance > 0 ? digits(all.length * all.deck.position_tolerance) : "";
        return {{"Ties", ties},
                {"Position tolerance", ties.empty() ? "" : tolerance},
                {"Contacts", contacts},
                {"Points", points},
                {"Masses", lumped_lists["*MASS"]},
                {"Springs", lumped_lists["*SPRING"]},
                {"Dashpots", lumped_lists["*DASHPOT"]}};
      }

    private:
      /// The point of a node: that of the surface to which a coupling ties it, or in space.
      std::optional<std::string> point_of(const std::string &node, Point<3> &x)
      {
        const std::string surface = all.coupled_surface(node);
        const auto found          = all.deck.nodes.find(node);
        if (found == all.deck.nodes.end())
          return {};
        x = found->second;
        if (!surface.empty())
          all.faces_of(surface);
        else
        {
          // Exactly: both were read from the same text.
          for (const ElementFile::Element &element : all.mesh.elements)
            for (const unsigned int of_mesh : element.nodes)
              if (all.mesh.nodes[of_mesh] == x)
                return {};
        }
        const std::string name = "P" + node;
        points_used[name]      = surface.empty() ? all.place_of(x) : surface;
        return name;
      }

      void add_lumped(const DeckLumped &lumped)
      {
        const auto pass_over = [&](const std::string &why)
        { all.leave_out(DeckMeaning::joins, lumped.where + ": " + lumped.kind + ", " + why); };
        const std::vector<std::vector<double>> &rows = lumped.rows;
        const auto elements = all.deck.lumped_elements.find(lumped.elements);
        if (elements == all.deck.lumped_elements.end())
          return pass_over("the set " + lumped.elements + " has no elements outside of parts");
        const double mass_unit = all.length == 1 ? 1 : 1e3;
        std::string &list      = lumped_lists[lumped.kind];
        for (const DeckLumpedElement &element : elements->second)
        {
          std::vector<std::string> names;
          std::vector<Point<3>> places(2);
          for (unsigned int k = 0; k < std::min<std::size_t>(2, element.nodes.size()); ++k)
            if (const auto name = point_of(element.nodes[k], places[k]))
              names.push_back(*name);
          if (names.empty() || names.size() != element.nodes.size())
          {
            pass_over("at a node of the mesh or a part; a *COUPLING to a surface makes it a point");
            continue;
          }
          if (lumped.kind == "*MASS" && !rows.empty() && !rows[0].empty())
            append(list, names[0] + " : " + digits(mass_unit * rows[0][0]));
          else if (element.type == "SPRINGA" || element.type == "DASHPOTA")
          {
            // Its first data line is empty.
            const double value           = rows.empty() || rows.back().empty() ? 0 : rows.back()[0];
            const Tensor<1, 3> direction = places[1] - places[0];
            if (names.size() != 2 || direction.norm() == 0)
            {
              pass_over("between points at one place, which has no direction");
              continue;
            }
            std::array<double, 3> along{};
            for (unsigned int d = 0; d < 3; ++d)
              along[all.placed(d)] = direction[d] / direction.norm();
            append(list, names[0] + " : " + names[1] + " : " + digits(value / all.length) +
                             " 0 0 : " + digits(along[0]) + " " + digits(along[1]) + " " +
                             digits(along[2]));
          }
          else if (rows.size() >= 2 && !rows[0].empty() && !rows[1].empty())
          {
            const double component = rows[0][0];
            const unsigned int of  = component >= 1 && component <= 6 ? component : 0;
            if (of == 0 || (names.size() == 2 && (rows[0].size() < 2 || rows[0][1] != component)))
            {
              pass_over("between two different components");
              continue;
            }
            std::array<double, 6> values{};
            // N mm per radian
            values[of > 3 ? 3 + all.placed(of - 4) : all.placed(of - 1)] =
                rows[1][0] * (of > 3 ? all.length : 1 / all.length);
            append(list, names[0] + " : " + (names.size() == 2 ? names[1] : "ground") + " :");
            for (const double value : values)
              list += " " + digits(value);
          }
          else
            pass_over("without values");
        }
      }

      DeckAssembly &all;
      std::map<std::string, std::string> points_used, lumped_lists;
    };
  } // namespace

  std::vector<DeckSetting> deck_joints(DeckAssembly &all)
  {
    return DeckJoints(all).settings();
  }
} // namespace squeal
