#include <squeal/base/text.h>
#include <squeal/scenes/deck_sections.h>

#include <algorithm>

namespace squeal
{
  using namespace dealii;
  using namespace deck_text;

  namespace
  {
    /// Collects what presses on surfaces.
    class DeckLoadReader
    {
    public:
      explicit DeckLoadReader(DeckAssembly &all) : all(all) {}

      /// One pressure on all surfaces is that of the pads, which a study may vary; several have a
      /// list of their own.
      DeckLoads loads()
      {
        for (const DeckPressure &of : all.deck.pressures)
          add(of.surface, of.value);
        add_forces();
        DeckLoads result;
        if (pressures.empty())
          return result;
        const double first = pressures.begin()->second;
        const bool is_one  = first > 0 && !share_a_face() &&
                            std::all_of(pressures.begin(), pressures.end(),
                                        [&](const auto &entry) { return entry.second == first; });
        std::string surfaces, with_values;
        for (const auto &[surface, value] : pressures)
        {
          append(surfaces, surface);
          append(with_values, surface + " : " + digits(value / (all.length * all.length)));
        }
        if (is_one)
          result.pads_pressure = first / (all.length * all.length);
        result.of_mesh.push_back(is_one ? DeckSetting{"Pressure on", surfaces}
                                        : DeckSetting{"Pressures", with_values});
        return result;
      }

    private:
      void add(const std::string &surface, const double value)
      {
        all.faces_of(surface); // throws where there is none
        pressures[surface] += value;
      }

      /// Whether a face is in two of the surfaces: its pressures add up.
      bool share_a_face() const
      {
        std::set<ElementFile::Face> faces;
        for (const auto &[surface, value] : pressures)
        {
          std::set<ElementFile::Face> own;
          for (const ElementFile::Face &face : all.faces_of(surface))
            own.insert(ElementFile::ascending(face));
          const std::size_t before = faces.size();
          faces.insert(own.begin(), own.end());
          if (faces.size() < before + own.size())
            return true;
        }
        return false;
      }

      /// Forces on the nodes of a plane surface, or on a point that is tied to one.
      void add_forces()
      {
        std::map<std::string, Tensor<1, 3>> by_nodes;
        std::map<std::string, std::string> where;
        for (const DeckForce &force : all.deck.forces)
        {
          by_nodes[force.nodes][force.component] += force.value;
          where[force.nodes] = force.where;
        }
        for (const auto &[nodes, force] : by_nodes)
          if (const std::string problem = add_force(nodes, force); !problem.empty())
            all.leave_out(DeckMeaning::load, where[nodes] + ": *CLOAD, " + nodes + ": " + problem +
                                                 ". Load the surface: *DSLOAD with P");
      }

      /// Adds the pressure p = -F . n / A whose resultant a force is. Returns why there is none.
      std::string add_force(const std::string &nodes, const Tensor<1, 3> &on_each)
      {
        constexpr double plane = 1e-3, beside = 0.05; // parts of area or force; of the extent
        if (!all.deck.transforms.empty())
          return "the deck has *TRANSFORM, in whose directions forces are not read";
        Point<3> point;
        Tensor<1, 3> force  = on_each;
        std::string surface = all.coupled_surface(nodes);
        if (!surface.empty())
        {
          const auto set = all.deck.node_of_set.find(nodes);
          const auto node =
              all.deck.nodes.find(set == all.deck.node_of_set.end() ? nodes : set->second);
          if (node == all.deck.nodes.end())
            return "the place of the node is not known";
          point = node->second;
        }
        else
        {
          const auto set = all.mesh.node_sets.find(nodes);
          if (set == all.mesh.node_sets.end() || all.mesh.surfaces.count(nodes) == 0 ||
              all.mesh.surfaces.at(nodes).empty())
            return "forces on single nodes and edges grow without bound as meshes become fine";
          surface                           = nodes;
          const std::set<unsigned int> on   = all.nodes_on(surface);
          const std::set<unsigned int> have = {set->second.begin(), set->second.end()};
          if (!std::includes(on.begin(), on.end(), have.begin(), have.end()))
            return "some of the nodes are on no face all of whose corners are loaded";
          for (const unsigned int node : have)
            point += all.mesh.nodes[node] / double(have.size());
          force *= double(have.size());
        }
        const auto [area, centre] = all.area_vector_of(surface);
        if (area.norm() < (1 - plane) * all.area_of(surface))
          return "the surface " + surface + " is not plane";
        const Tensor<1, 3> normal = area / area.norm();
        if ((force - (force * normal) * normal).norm() > plane * force.norm())
          return "the force is not along the normal of " + surface + ", as a pressure is";
        const Tensor<1, 3> arm = (point - centre) - ((point - centre) * normal) * normal;
        if (arm.norm() > beside * all.extent_of(surface))
          return text_of("it acts ", digits(arm.norm() * all.length), " m beside the centre of ",
                         surface, ", where the resultant of a pressure is");
        add(surface, -(force * normal) / area.norm());
        all.deck.passed_over.push_back(
            text_of("*CLOAD, ", nodes, ": ", number(force.norm(), 6), " (units of the deck) on ",
                    surface, " is a uniform pressure here, of this resultant, which acts ",
                    number(arm.norm() * all.length, 3), " m beside it"));
        return "";
      }

      DeckAssembly &all;
      std::map<std::string, double> pressures; ///< by surface, in units of the deck
    };
  } // namespace

  DeckLoads deck_loads(DeckAssembly &all)
  {
    return DeckLoadReader(all).loads();
  }
} // namespace squeal
