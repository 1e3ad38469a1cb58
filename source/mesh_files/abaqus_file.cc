#include <squeal/base/errors.h>
#include <squeal/mesh_files/deck_keywords.h>
#include <squeal/mesh_files/deck_lines.h>
#include <squeal/mesh_files/element_file.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <set>
#include <unordered_map>

// A deck of Abaqus or CalculiX as solid elements. AbaqusReader takes keyword by keyword
// (DeckLines): begin() chooses what takes the data lines. A part is kept as lines, which each
// instance reads again, placed. Sets are numbers by instance (NumberSet, ScopedSet), which
// resolve() turns into elements, faces and nodes at the end.

namespace squeal
{
  namespace
  {
    /// Numbers of nodes or elements. Generated ones are kept as first, last and step: a range may
    /// name millions that do not exist.
    struct NumberSet
    {
      std::set<long> numbers;
      std::set<std::array<long, 3>> ranges;

      void insert(const NumberSet &other)
      {
        numbers.insert(other.numbers.begin(), other.numbers.end());
        ranges.insert(other.ranges.begin(), other.ranges.end());
      }

      /// Returns the numbers that @p known, a map by number, has, ascending. The time is bounded by
      /// what is known and not by what a range claims.
      template <typename Known>
      std::set<long> members_of(const Known &known) const
      {
        std::set<long> members;
        for (const long number : numbers)
          if (known.count(number) > 0)
            members.insert(number);
        long seen = -1; // ranges of step 1 begin behind what others have taken
        for (const auto &[first, last, step] : ranges)
        {
          const long begin = step == 1 ? std::max(first, seen + 1) : first;
          if (begin > last)
            continue;
          if (std::size_t((last - begin) / step) < known.size())
            // Counted, since last + step may be too large for an integer.
            for (long k = 0; k <= (last - begin) / step; ++k)
            {
              if (known.count(begin + k * step) > 0)
                members.insert(begin + k * step);
            }
          else
            for (const auto &entry : known)
              if (entry.first >= begin && entry.first <= last && (entry.first - begin) % step == 0)
                members.insert(entry.first);
          if (step == 1)
            seen = std::max(seen, last);
        }
        return members;
      }
    };

    /// What is known of a type of elements.
    struct ElementType
    {
      unsigned int n_nodes;
      unsigned int n_corners; ///< of a face; 0: a solid element
      ElementShape shape;
    };

    /// What a type of elements is, or nothing for an unknown one. Letters behind the number of
    /// nodes say what happens inside of an element, or which fields it has beside the displacement,
    /// which does not matter here: R reduced integration, I incompatible modes, H hybrid, M
    /// modified, S stresses on the surface, T temperature, P pore pressure, E electric potential.
    std::optional<ElementType> element_type_of(const std::string &name)
    {
      static const std::map<std::string, ElementType>
          solids      = {{"C3D4", {4, 0, ElementShape::tetrahedron}},
                         {"C3D6", {6, 0, ElementShape::wedge}},
                         {"C3D8", {8, 0, ElementShape::hexahedron}},
                         {"C3D10", {10, 0, ElementShape::tetrahedron}},
                         {"C3D15", {15, 0, ElementShape::wedge}},
                         {"C3D20", {20, 0, ElementShape::hexahedron}}},
          flat        = {{"S3", {3, 3, {}}},     {"M3D3", {3, 3, {}}},  {"CPS3", {3, 3, {}}},
                         {"SFM3D3", {3, 3, {}}}, {"S6", {6, 3, {}}},    {"STRI65", {6, 3, {}}},
                         {"M3D6", {6, 3, {}}},   {"CPS6", {6, 3, {}}},  {"SFM3D6", {6, 3, {}}},
                         {"S4", {4, 4, {}}},     {"M3D4", {4, 4, {}}},  {"CPS4", {4, 4, {}}},
                         {"SFM3D4", {4, 4, {}}}, {"S8", {8, 4, {}}},    {"M3D8", {8, 4, {}}},
                         {"CPS8", {8, 4, {}}},   {"SFM3D8", {8, 4, {}}}};
      const auto find = [&](const auto &types, const std::string &letters)
      {
        const std::size_t end = name.find_last_not_of(letters) + 1;
        const auto found      = types.find(name.substr(0, end));
        return found == types.end() ? std::nullopt : std::optional<ElementType>(found->second);
      };
      if (const auto solid = find(solids, "RIHMSTPE"))
        return solid;
      if (const auto found = flat.find(name); found != flat.end())
        return found->second;
      return find(flat, "RT5");
    }

    /// One deck: flat, or with parts and instances. Keywords that do not describe the mesh are
    /// passed over. A name INSTANCE.SET is that of a set of the instance's part.
    class AbaqusReader
    {
    public:
      AbaqusReader(std::istream &in, ElementFile &file) : lines(in, file.name), file(file) {}

      void read()
      {
        while (lines.next_keyword(keyword))
        {
          begin();
          for (std::vector<std::string> fields; lines.next_data(fields);)
            if (take)
              take(fields);
          finish_element();
          if (placing)
            begin_instance_lines();
        }
        if (!instance.empty())
          lines.fail("*INSTANCE has no *END INSTANCE.");
        resolve();
      }

    private:
      /// Numbers of an instance's nodes and elements, or of those outside of all.
      struct Scope
      {
        std::unordered_map<long, unsigned int> nodes, elements;
        std::unordered_map<long, ElementFile::Face> faces;
      };
      /// The members of a set by instance.
      using ScopedSet = std::map<std::string, NumberSet>;

      void begin()
      {
        take                    = nullptr;
        const std::string &name = keyword.name;
        blocks_of_supports.see(name);
        if (name == "*NODE")
          begin_nodes();
        else if (name == "*ELEMENT")
          begin_elements();
        else if (name == "*ELSET" || name == "*NSET")
          begin_set(name == "*ELSET");
        else if (name == "*SURFACE")
          begin_surface();
        else if (name == "*DLOAD")
          begin_loads();
        else if (name == "*SOLID SECTION" && keyword.has("ELSET"))
          used.insert(full_name(element_sets, keyword.value("ELSET")));
        else if (name == "*CLOAD")
          take = [this](const std::vector<std::string> &fields)
          {
            if (!names_a_node(deck_label(fields[0])))
              used.insert(full_name(node_sets, deck_label(fields[0])));
          };
        else if (name == "*TRANSFORM" && keyword.has("NSET"))
          used.insert(full_name(node_sets, keyword.value("NSET")));
        else if (name == "*BOUNDARY")
          take = [this](const std::vector<std::string> &fields)
          {
            const std::string name = deck_label(fields[0]);
            if (names_a_node(name))
            {
              const std::string set = blocks_of_supports.set_of_nodes(fields);
              insert(node_sets[set], members(node_sets, fields[0]));
              used.insert(set);
            }
            else
              used.insert(full_name(node_sets, name));
          };
        else if (name == "*PART")
          read_part();
        else if (name == "*INSTANCE")
          begin_instance();
        else if (name == "*END INSTANCE")
          instance.clear();
        else if (name == "*NGEN" || name == "*ELGEN" || name == "*NFILL" || name == "*NCOPY" ||
                 name == "*ELCOPY" || name == "*SYSTEM" || name == "*NMAP")
          lines.fail(name +
                     " is not followed: it generates or moves nodes. Write the mesh out with "
                     "all nodes and elements, as preprocessors do.");
      }

      std::string need_option(const std::string &option) const
      {
        const std::string value = keyword.value(option);
        if (value.empty())
          lines.fail(keyword.name + " needs " + option + "=.");
        return value;
      }

      // Parts and instances

      /// A part is kept as lines, which each of its instances reads.
      void read_part()
      {
        const std::string name = need_option("NAME");
        if (!parts.emplace(name, std::vector<DeckLines::Line>()).second)
          lines.fail("the part " + name + " occurs twice.");
        std::string line;
        while (true)
        {
          if (!lines.next(line))
            lines.fail("*PART, NAME=" + name + " has no *END PART.");
          const std::string what = line[0] == '*' ? deck_keyword(line) : "";
          if (what == "*END PART")
            return;
          if (what == "*PART" || what == "*ASSEMBLY")
            lines.fail("*PART, NAME=" + name + " has no *END PART before this line.");
          parts.at(name).push_back(lines.current());
        }
      }

      void begin_instance()
      {
        if (!instance.empty())
          lines.fail("*INSTANCE inside of another; *END INSTANCE is missing.");
        const std::string name = need_option("NAME"), part = need_option("PART");
        if (parts.count(part) == 0)
        {
          std::string known;
          for (const auto &other : parts)
            known += (known.empty() ? "" : ", ") + other.first;
          lines.fail("there is no part " + part + " before this line. Allowed are: " +
                     (known.empty() ? "none, there are no parts" : known) + ".");
        }
        if (scopes.count(name) > 0)
          lines.fail("the instance " + name + " occurs twice.");
        instance        = name;
        instance_part   = part;
        placement       = {};
        n_placing_lines = 0;
        placing         = true;
        take            = [this](const std::vector<std::string> &fields)
        {
          const std::size_t first = n_placing_lines == 0 ? 0 : 3, n = n_placing_lines == 0 ? 3 : 7;
          if (n_placing_lines > 1 || fields.size() < n)
            lines.fail("*INSTANCE: expected a translation of three numbers, and then a rotation of "
                       "two points and an angle in degrees.");
          for (std::size_t k = 0; k < n; ++k)
            placement[first + k] = lines.real(fields[k]);
          ++n_placing_lines;
        };
      }

      void begin_instance_lines()
      {
        placing = false;
        scopes[instance];
        const auto *p = &placement[3];
        if (n_placing_lines > 1 && std::hypot(p[3] - p[0], p[4] - p[1], p[5] - p[2]) == 0)
          lines.fail("*INSTANCE: the two points of the axis of rotation are one.");
        lines.replay(parts.at(instance_part));
      }

      /// Translated, then turned about the axis between two points (Rodrigues).
      dealii::Point<3> placed(dealii::Point<3> x) const
      {
        using Vector = dealii::Tensor<1, 3>;
        if (instance.empty())
          return x;
        for (unsigned int d = 0; d < 3; ++d)
          x[d] += placement[d];
        if (n_placing_lines < 2)
          return x;
        const dealii::Point<3> a(placement[3], placement[4], placement[5]),
            b(placement[6], placement[7], placement[8]);
        const double angle = placement[9] * std::acos(-1.) / 180;
        const Vector axis = (b - a) / (b - a).norm(), arm = x - a;
        const Vector turned = std::cos(angle) * arm +
                              std::sin(angle) * cross_product_3d(axis, arm) +
                              (1 - std::cos(angle)) * (axis * arm) * axis;
        return a + turned;
      }

      // Names and numbers

      /// The instance in which the keyword's numbers are.
      std::string scope_name() const
      {
        return instance.empty() ? keyword.value("INSTANCE") : instance;
      }

      Scope &scope(const std::string &name)
      {
        if (name.empty() || name == instance)
          return scopes[name];
        const auto found = scopes.find(name);
        if (found == scopes.end())
          lines.fail("there is no instance " + name + " before this line.");
        return found->second;
      }

      std::string name_here(const std::string &name) const
      {
        return instance.empty() ? name : instance + "." + name;
      }

      /// A set's name with its instance, as it is known here; the plain name where it is not.
      template <typename Sets>
      std::string full_name(const Sets &sets, const std::string &name) const
      {
        const std::string in = scope_name();
        return !in.empty() && sets.count(in + "." + name) > 0 ? in + "." + name : name;
      }

      /// A number, instance.number or the name of a set.
      ScopedSet members(const std::map<std::string, ScopedSet> &sets, const std::string &field)
      {
        const std::string in = scope_name();
        if (is_deck_number(field))
        {
          scope(in);
          return {{in, NumberSet{{lines.integer(field)}, {}}}};
        }
        const std::string name = deck_label(field);
        const auto set         = sets.find(full_name(sets, name));
        if (set != sets.end())
          return set->second;
        const std::size_t dot = name.rfind('.');
        if (dot != std::string::npos && is_deck_number(name.substr(dot + 1)) &&
            scopes.count(name.substr(0, dot)) > 0)
          return {{name.substr(0, dot), NumberSet{{lines.integer(name.substr(dot + 1))}, {}}}};
        lines.fail("the set " + field.substr(0, 60) + " is not known here.");
      }

      static void insert(ScopedSet &set, const ScopedSet &other)
      {
        for (const auto &[name, numbers] : other)
          set[name].insert(numbers);
      }

      // The mesh

      void begin_nodes()
      {
        if (!keyword.value("SYSTEM").empty() && keyword.value("SYSTEM") != "R")
          lines.fail("*NODE, SYSTEM=" + keyword.value("SYSTEM") + ": only Cartesian coordinates.");
        const std::string set = keyword.value("NSET");
        take                  = [this, set](const std::vector<std::string> &fields)
        {
          if (fields.size() < 2)
            lines.fail("expected a node's number and its coordinates.");
          const long number = lines.integer(fields[0]);
          if (!scopes[instance].nodes.emplace(number, file.nodes.size()).second)
            lines.fail("node " + fields[0] + " occurs twice.");
          // Those that a line leaves out are zero.
          dealii::Point<3> x;
          for (unsigned int d = 0; d < 3 && d + 1 < fields.size(); ++d)
            if (!fields[d + 1].empty())
              x[d] = lines.real(fields[d + 1]);
          file.nodes.push_back(placed(x));
          node_numbers.push_back(number);
          if (!set.empty())
            node_sets[name_here(set)][instance].numbers.insert(number);
        };
      }

      void begin_elements()
      {
        const std::string type                         = need_option("TYPE");
        static const std::set<std::string> passed_over = {
            "T3D2",    "T3D3",    "B31",     "B31H",    "B32",      "B33",      "MASS",
            "ROTARYI", "SPRINGA", "SPRING1", "SPRING2", "DASHPOTA", "DASHPOT1", "DASHPOT2",
            "CONN3D2", "DCOUP3D", "R3D3",    "R3D4",    "GAPUNI"};
        const std::optional<ElementType> known = element_type_of(type);
        if (!known)
        {
          if (passed_over.count(type) == 0)
            lines.fail("elements of type " + type +
                       "; allowed are the solids C3D4, C3D6, C3D8, C3D10, C3D15, C3D20 (also with "
                       "R, I, H, M, T and the like), and on their faces S3, S4, S6, S8, M3D3 and "
                       "the like, which only name them. Take the others out of the deck, or mesh "
                       "what they stand for with solids.");
          take = [this, type](const std::vector<std::string> &) { ++file.passed_over[type]; };
          return;
        }
        element_type = *known;
        element_set  = keyword.value("ELSET");
        take         = [this](const std::vector<std::string> &fields)
        {
          for (const std::string &field : fields)
            if (!field.empty())
              element.push_back(lines.integer(field));
          if (element.size() > element_type.n_nodes)
            finish_element();
        };
      }

      /// Number and nodes of an element are complete.
      void finish_element()
      {
        if (element.empty())
          return;
        const std::string number = std::to_string(element[0]);
        if (element.size() != element_type.n_nodes + 1)
          lines.fail("element " + number + " should have " + std::to_string(element_type.n_nodes) +
                     " nodes, not " + std::to_string(element.size() - 1) +
                     ". Write the TYPE= that has so many; a line ends with a comma where the "
                     "element's nodes go on in the next.");
        Scope &here = scopes[instance];
        std::vector<unsigned int> nodes;
        for (unsigned int v = 0; v < element_type.n_nodes; ++v)
        {
          const auto node = here.nodes.find(element[v + 1]);
          if (node == here.nodes.end())
            lines.fail("element " + number + " has the unknown node " +
                       std::to_string(element[v + 1]) + ".");
          nodes.push_back(node->second);
        }
        bool is_new = false;
        if (element_type.n_corners == 0)
        {
          is_new = here.elements.emplace(element[0], file.elements.size()).second;
          if (!instance.empty())
            file.volumes[instance].push_back(file.elements.size());
          file.elements.push_back({element_type.shape, nodes, element[0], lines.line_number()});
        }
        else
        {
          const ElementFile::Face face = {
              {nodes[0], nodes[1], nodes[2],
               element_type.n_corners == 4 ? nodes[3] : ElementFile::none}};
          is_new = here.faces.emplace(element[0], face).second;
        }
        if (!is_new || here.elements.count(element[0]) + here.faces.count(element[0]) > 1)
          lines.fail("element " + number + " occurs twice.");
        if (!element_set.empty())
          element_sets[name_here(element_set)][instance].numbers.insert(element[0]);
        element.clear();
      }

      void begin_set(const bool of_elements)
      {
        auto &sets             = of_elements ? element_sets : node_sets;
        const std::string name = name_here(need_option(of_elements ? "ELSET" : "NSET"));
        ScopedSet &set         = sets[name];
        if (keyword.has("INTERNAL"))
          internal.insert(name);
        const bool generate  = keyword.has("GENERATE");
        const std::string in = scope_name();
        scope(in);
        if (!of_elements && keyword.has("ELSET"))
          insert(set, nodes_of(members(element_sets, keyword.value("ELSET"))));
        take = [this, &sets, &set, generate, in](const std::vector<std::string> &fields)
        {
          if (generate)
          {
            if (fields.size() < 2)
              lines.fail("GENERATE: expected first, last, step.");
            const long first = lines.integer(fields[0]), last = lines.integer(fields[1]),
                       step =
                           fields.size() > 2 && !fields[2].empty() ? lines.integer(fields[2]) : 1;
            if (step < 1 || first < 0 || last < first || (last - first) / step > 10000000)
              lines.fail("GENERATE: expected 0 <= first <= last, a step of at least 1, and at most "
                         "ten million members.");
            set[in].ranges.insert(std::array<long, 3>{{first, last, step}});
            return;
          }
          for (const std::string &field : fields)
            if (!field.empty())
              insert(set, members(sets, field));
        };
      }

      /// All nodes of some elements.
      ScopedSet nodes_of(const ScopedSet &elements)
      {
        ScopedSet nodes;
        for (const auto &[in, set] : elements)
        {
          const Scope &here = scope(in);
          for (const long element : set.members_of(here.elements))
            for (const unsigned int node : file.elements[here.elements.at(element)].nodes)
              nodes[in].numbers.insert(node_numbers[node]);
          for (const long element : set.members_of(here.faces))
            for (const unsigned int node : here.faces.at(element))
              if (node != ElementFile::none)
                nodes[in].numbers.insert(node_numbers[node]);
        }
        return nodes;
      }

      void begin_surface()
      {
        const std::string name = name_here(need_option("NAME"));
        const std::string type = keyword.has("TYPE") ? keyword.value("TYPE") : "ELEMENT";
        if (type != "ELEMENT" && type != "NODE")
          lines.fail("*SURFACE, TYPE=" + type + ": allowed are ELEMENT and NODE.");
        if (type == "NODE")
        {
          take = [this, name](const std::vector<std::string> &fields)
          { insert(node_sets[name], members(node_sets, fields[0])); };
          return;
        }
        take = [this, name](const std::vector<std::string> &fields)
        {
          const std::string side = fields.size() > 1 ? deck_label(fields[1]) : "";
          const bool is_face =
                         side.size() == 2 && side[0] == 'S' && side[1] >= '1' && side[1] <= '6',
                     is_shell_side = side == "SPOS" || side == "SNEG";
          if (!is_face && !is_shell_side && !side.empty())
            lines.fail(
                "expected an element or a set and one of its faces S1 to S6, nothing behind it "
                "for all its faces that are free, or SPOS or SNEG of shells.");
          // _SURF_S3, by which a preprocessor collects the elements of one face of SURF, and which
          // not all of them mark as internal.
          if (const std::string set = deck_label(fields[0]);
              is_face && set.size() > 3 && set[0] == '_' &&
              set.substr(set.size() - 3) == "_" + side)
            internal.insert(full_name(element_sets, set));
          add_faces(name, fields[0], side);
        };
      }

      /// Loads on faces of elements, whose surfaces serve --from-deck.
      void begin_loads()
      {
        take = [this](const std::vector<std::string> &fields)
        {
          const std::string side =
              fields.size() > 1 ? deck_side_of_load(deck_label(fields[1])) : "";
          if (side.empty())
            return;
          const std::string name = deck_load_surface(deck_label(fields[0]), side);
          if (file.surfaces.count(name) == 0) // each step may say it anew
            add_faces(name, fields[0], side);
        };
      }

      /// Adds to a surface the faces S1 to S6 of elements, a number or a set; of shells SPOS or
      /// SNEG; nothing: all their faces that are free.
      void add_faces(const std::string &name, const std::string &of_elements,
                     const std::string &side)
      {
        const bool is_shell_side = side == "SPOS" || side == "SNEG",
                   is_face       = !side.empty() && !is_shell_side;
        for (const auto &[in, elements] : members(element_sets, of_elements))
        {
          const Scope &here = scope(in);
          const auto add    = [&](const long number)
          {
            const auto solid       = here.elements.find(number);
            const auto shell       = here.faces.find(number);
            const std::string text = "element " + std::to_string(number);
            if (shell != here.faces.end() && !is_face)
              file.surfaces[name].push_back(shell->second);
            else if (solid == here.elements.end() || is_shell_side)
              lines.fail(text + (is_shell_side ? " is no shell of this file."
                                 : shell == here.faces.end()
                                     ? " is no solid element of this file."
                                     : " is a shell, of whose edges there are no surfaces. Name a "
                                       "face of the solid below it, or its sides SPOS or SNEG."));
            else if (side.empty())
              free_faces_of[name].push_back(solid->second);
            else
            {
              const ElementFile::Element &of = file.elements[solid->second];
              const unsigned int f = side[1] - '1', n = ElementFile::faces(of.shape).size();
              if (f >= n)
                lines.fail(text + " has no face " + side + ", only S1 to S" + std::to_string(n) +
                           ".");
              file.surfaces[name].push_back(file.face(of, f));
            }
          };
          for (const long element : elements.numbers)
            add(element);
          // The first that does not exist ends it.
          for (const auto &[first, last, step] : elements.ranges)
            for (long k = 0; k <= (last - first) / step; ++k)
              add(first + k * step);
        }
      }

      /// Surfaces that are all faces of some elements that no other element has.
      void add_free_faces()
      {
        if (free_faces_of.empty())
          return;
        const std::map<ElementFile::Face, ElementFile::Face> free = file.free_faces();
        for (const auto &[name, elements] : free_faces_of)
          for (const unsigned int e : elements)
            for (unsigned int f = 0; f < ElementFile::faces(file.elements[e].shape).size(); ++f)
              if (const ElementFile::Face face = file.face(file.elements[e], f);
                  free.count(ElementFile::ascending(face)) > 0)
                file.surfaces[name].push_back(face);
      }

      /// Sets of elements become volumes or surfaces. Those that preprocessors make for surfaces
      /// and picks of their own are left out, unless a section gives them a material or a support
      /// holds them.
      void resolve()
      {
        add_free_faces();
        for (const auto &[name, set] : element_sets)
          if (internal.count(name) == 0 || used.count(name) > 0)
            for (const auto &[in, elements] : set)
            {
              const Scope &here = scopes[in];
              for (const long element : elements.members_of(here.elements))
                file.volumes[name].push_back(here.elements.at(element));
              for (const long element : elements.members_of(here.faces))
                file.surfaces[name].push_back(here.faces.at(element));
            }
        for (const auto &[name, set] : node_sets)
          if (internal.count(name) == 0 || used.count(name) > 0)
            for (const auto &[in, nodes] : set)
            {
              const Scope &here = scopes[in];
              for (const long node : nodes.members_of(here.nodes))
                file.node_sets[name].push_back(here.nodes.at(node));
            }
      }

      DeckLines lines;
      ElementFile &file;
      DeckKeyword keyword;
      std::function<void(const std::vector<std::string> &)> take;

      std::map<std::string, std::vector<DeckLines::Line>> parts;
      std::string instance, instance_part; ///< empty: outside of all
      bool placing = false;                ///< its data lines are being read
      std::array<double, 10> placement{};  ///< translation, two points, degrees
      unsigned int n_placing_lines = 0;

      ElementType element_type{};
      std::string element_set;
      std::vector<long> element; ///< number and nodes so far
      std::map<std::string, Scope> scopes;
      std::map<std::string, ScopedSet> element_sets, node_sets;
      std::map<std::string, std::vector<unsigned int>> free_faces_of; ///< elements by surface
      std::set<std::string> internal, used;
      std::vector<long> node_numbers; ///< of the file's nodes
      SupportBlocks blocks_of_supports;
    };
  } // namespace

  void read_abaqus(std::istream &in, ElementFile &file)
  {
    AbaqusReader(in, file).read();
  }
} // namespace squeal
