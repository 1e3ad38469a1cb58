#include <squeal/base/text.h>
#include <squeal/scenes/deck_sections.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace squeal
{
  using namespace dealii;
  using namespace deck_text;

  namespace
  {
    /// What of *BOUNDARY the faces of a mesh can hold.
    class DeckSupports
    {
    public:
      explicit DeckSupports(DeckAssembly &all) : all(all)
      {
        for (const ElementFile::Element &element : all.mesh.elements)
          of_elements.insert(element.nodes.begin(), element.nodes.end());
      }

      std::vector<DeckSetting> settings()
      {
        apply_transforms();
        check_supports();
        std::map<std::string, std::set<unsigned int>> components;
        for (const DeckSupport &support : all.deck.supports)
          if (all.mesh.surfaces.count(support.nodes) > 0)
            for (const unsigned int d : support.components)
              components[support.nodes].insert(all.placed(d));
        std::map<std::string, std::set<std::string>> names;
        for (const auto &[surface, fixed] : components)
          if (fixed.size() == 3)
            names["Clamped"].insert(surface);
          else if (fixed == std::set<unsigned int>{0, 1})
            names["Guided"].insert(surface);
          else
            for (const unsigned int d : fixed)
              names[std::string("Fixed in ") + "xyz"[d]].insert(surface);
        std::vector<DeckSetting> result;
        for (const auto &[key, surfaces] : names)
          result.push_back({key, list_of(surfaces)});
        return result;
      }

    private:
      /// Nodes of elements all of whose corners are in a set.
      std::set<unsigned int> nodes_of_elements_in(const std::set<unsigned int> &set) const
      {
        std::set<unsigned int> nodes;
        for (const ElementFile::Element &element : all.mesh.elements)
          if (std::all_of(element.nodes.begin(),
                          element.nodes.begin() + ElementFile::n_corners(element.shape),
                          [&](const unsigned int node) { return set.count(node) > 0; }))
            nodes.insert(element.nodes.begin(), element.nodes.end());
        return nodes;
      }

      /// Each node that is held must be on a face that is, in the same direction: an edge or a
      /// single node holds nothing as meshes become fine.
      void check_supports()
      {
        std::array<std::set<unsigned int>, 3> held;
        for (const DeckSupport &support : all.deck.supports)
          if (all.mesh.surfaces.count(support.nodes) > 0)
            for (const unsigned int d : support.components)
              held[d].merge(all.nodes_on(support.nodes));
        for (const DeckSupport &support : all.deck.supports)
        {
          std::set<unsigned int> nodes, missing;
          if (const auto set = all.mesh.node_sets.find(support.nodes);
              set != all.mesh.node_sets.end())
            for (const unsigned int node : set->second)
              if (of_elements.count(node) > 0)
                nodes.insert(node);
          const std::string what = support.where + ": *BOUNDARY, " + support.nodes;
          if (nodes.empty() && all.mesh.surfaces.count(support.nodes) == 0)
          {
            all.leave_out(DeckMeaning::holds,
                          what + " holds no nodes of solid elements. What a *COUPLING or *RIGID "
                                 "BODY ties to the node is not held: hold the surface");
            continue;
          }
          if (const std::string point = point_in(support.nodes); !point.empty())
            all.leave_out(DeckMeaning::holds, what + " holds the node " + point +
                                                  ", too, which a *COUPLING or a spring has: a "
                                                  "support holds faces only");
          const std::set<unsigned int> inside = nodes_of_elements_in(nodes);
          for (const unsigned int d : support.components)
            for (const unsigned int node : nodes)
              if (held[d].count(node) == 0 && inside.count(node) == 0)
                missing.insert(node);
          if (!missing.empty())
            all.leave_out(
                DeckMeaning::holds,
                text_of(what, ": ", missing.size(), " of ", nodes.size(),
                        " nodes, among them that at (", all.mesh.nodes[*missing.begin()],
                        "), are on no face all of whose corners are held. Edges and single "
                        "nodes hold nothing as meshes become fine: hold faces"));
        }
      }

      /// Returns a node of a set that is a point of couplings or lumped elements; empty: none is.
      std::string point_in(const std::string &set) const
      {
        const auto members = all.mesh.node_sets.find(set);
        if (members == all.mesh.node_sets.end())
          return "";
        std::set<std::string> points;
        for (const auto &[node, surface] : all.deck.surface_of_node)
        {
          const auto single = all.deck.node_of_set.find(node);
          points.insert(single == all.deck.node_of_set.end() ? node : single->second);
        }
        for (const auto &[name, elements] : all.deck.lumped_elements)
          for (const DeckLumpedElement &element : elements)
            points.insert(element.nodes.begin(), element.nodes.end());
        for (const std::string &point : points)
          if (const auto known = all.deck.nodes.find(point); known != all.deck.nodes.end())
            for (const unsigned int node : members->second)
              // Exactly: both were read from the same text.
              if (of_elements.count(node) == 0 && all.mesh.nodes[node] == known->second)
                return point;
        return "";
      }

      /// The deck's components of those that are held in another system; nothing: they are along no
      /// axes of the deck.
      std::optional<std::set<unsigned int>> along_axes(const DeckTransform &transform,
                                                       const std::set<unsigned int> &held) const
      {
        if (held.size() == 3)
          return held;
        const auto coordinate = [](const Tensor<1, 3> &v) -> std::optional<unsigned int>
        {
          for (unsigned int d = 0; d < 3; ++d)
            if (std::abs(v[d]) > (1 - 1e-10) * v.norm())
              return d;
          return {};
        };
        std::set<unsigned int> result;
        const Tensor<1, 3> z = cross_product_3d(transform.first, transform.in_plane);
        if (transform.is_cylindrical)
        {
          // Along the circle and its radius only together, and about an axis of the deck
          const auto along = coordinate(transform.first);
          if (!along || held.count(0) != held.count(1))
            return {};
          for (unsigned int d = 0; d < 3; ++d)
            if (held.count(d == *along ? 2 : 0) > 0)
              result.insert(d);
          return result;
        }
        const std::array<Tensor<1, 3>, 3> directions = {
            {transform.first, cross_product_3d(z, transform.first), z}};
        for (const unsigned int d : held)
          if (const auto along = coordinate(directions[d]))
            result.insert(*along);
          else
            return {};
        return result;
      }

      /// Supports of nodes that have a system of their own are turned into the deck's.
      void apply_transforms()
      {
        for (const DeckTransform &transform : all.deck.transforms)
        {
          const auto turned = all.mesh.node_sets.find(transform.nodes);
          if (turned == all.mesh.node_sets.end())
          {
            all.leave_out(DeckMeaning::holds, transform.where + ": *TRANSFORM, of nodes " +
                                                  transform.nodes + ", which are none of the mesh");
            continue;
          }
          const std::set<unsigned int> nodes(turned->second.begin(), turned->second.end());
          for (DeckSupport &support : all.deck.supports)
          {
            const auto set = all.mesh.node_sets.find(support.nodes);
            if (set == all.mesh.node_sets.end())
              continue;
            const std::size_t n =
                std::count_if(set->second.begin(), set->second.end(),
                              [&](const unsigned int node) { return nodes.count(node) > 0; });
            const auto components = along_axes(transform, support.components);
            if (n == 0 || (components && *components == support.components))
              continue;
            if (components && n == set->second.size())
              support.components = *components;
            else
              all.leave_out(DeckMeaning::holds, support.where + ": *BOUNDARY, " + support.nodes +
                                                    ", in the directions of *TRANSFORM (" +
                                                    transform.where +
                                                    "), which are not those of the axes" +
                                                    (components ? " of all of its nodes" : ""));
          }
        }
      }

      DeckAssembly &all;
      std::set<unsigned int> of_elements; ///< nodes that these have
    };
  } // namespace

  std::vector<DeckSetting> deck_supports(DeckAssembly &all)
  {
    return DeckSupports(all).settings();
  }
} // namespace squeal
