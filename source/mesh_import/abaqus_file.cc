#include <squeal/base/errors.h>
#include <squeal/mesh_import/mesh_file.h>

#include <algorithm>
#include <array>
#include <functional>
#include <set>
#include <unordered_map>

namespace squeal
{
  namespace
  {
    std::string trimmed(const std::string &text)
    {
      const std::size_t first = text.find_first_not_of(" \t"), last = text.find_last_not_of(" \t");
      return first == std::string::npos ? "" : text.substr(first, last - first + 1);
    }

    /// Labels and keywords are the same in capitals.
    std::string capitals(std::string text)
    {
      std::transform(text.begin(), text.end(), text.begin(),
                     [](const unsigned char c) { return std::toupper(c); });
      return text;
    }

    std::string label(const std::string &text)
    {
      std::string name = trimmed(text);
      name.erase(std::remove(name.begin(), name.end(), '"'), name.end());
      return capitals(name);
    }

    /// Fields between commas; an empty one at the end means that the data go on in the next line.
    std::vector<std::string> fields_of(const std::string &line)
    {
      std::vector<std::string> fields;
      std::size_t begin = 0;
      for (std::size_t comma = line.find(','); comma != std::string::npos;
           comma             = line.find(',', begin))
      {
        fields.push_back(trimmed(line.substr(begin, comma - begin)));
        begin = comma + 1;
      }
      fields.push_back(trimmed(line.substr(begin)));
      return fields;
    }

    bool is_number(const std::string &field)
    {
      return !field.empty() && field.find_first_not_of("+-0123456789") == std::string::npos;
    }

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

      /// Those that @p known, a map by number, has, ascending. The time is bounded by what is known
      /// and not by what a range claims.
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

    /// One flat input file. Keywords that do not describe the mesh are passed over.
    class AbaqusReader
    {
    public:
      AbaqusReader(std::istream &in, MeshFile &file) : lines(in, file.name), file(file) {}

      void read()
      {
        std::string line;
        bool has_line = lines.next(line);
        while (has_line)
        {
          if (line.empty() || line.rfind("**", 0) == 0)
          {
            has_line = lines.next(line);
            continue;
          }
          if (line[0] != '*')
            lines.fail("data without a keyword before them: '" + line.substr(0, 60) + "'.");
          read_keyword(line);
          // The keyword's data
          while ((has_line = lines.next(line)) && (line.rfind("**", 0) == 0 || line[0] != '*'))
            if (!line.empty() && line[0] != '*' && take)
              take(fields_of(line));
          finish_element();
        }
        resolve();
      }

    private:
      void read_keyword(std::string line)
      {
        while (line.back() == ',') // the options go on
          line += lines.need("the rest of " + line.substr(0, 60));
        const std::vector<std::string> fields = fields_of(line);
        keyword                               = capitals(fields[0]);
        options.clear();
        for (std::size_t i = 1; i < fields.size(); ++i)
        {
          const std::size_t equals = fields[i].find('=');
          options[capitals(trimmed(fields[i].substr(0, equals)))] =
              equals == std::string::npos ? "" : label(fields[i].substr(equals + 1));
        }
        take = nullptr;
        if (keyword == "*NODE")
          begin_nodes();
        else if (keyword == "*ELEMENT")
          begin_elements();
        else if (keyword == "*ELSET" || keyword == "*NSET")
          begin_set(keyword == "*ELSET");
        else if (keyword == "*SURFACE")
          begin_surface();
        else if (keyword == "*INSTANCE" || keyword == "*INCLUDE")
          lines.fail(keyword + " is not followed; a flat file is needed, without parts and "
                               "assemblies, in one piece.");
      }

      std::string need_option(const std::string &option) const
      {
        const auto found = options.find(option);
        if (found == options.end() || found->second.empty())
          lines.fail(keyword + " needs " + option + "=.");
        return found->second;
      }

      void begin_nodes()
      {
        if (options.count("SYSTEM") && options["SYSTEM"] != "R")
          lines.fail("*NODE, SYSTEM=" + options["SYSTEM"] + ": only Cartesian coordinates.");
        const std::string set = options.count("NSET") ? options["NSET"] : "";
        take                  = [this, set](const std::vector<std::string> &fields)
        {
          if (fields.size() < 4)
            lines.fail("expected a node's number and three coordinates.");
          const long number = lines.integer(fields[0]);
          if (!node_numbers.emplace(number, file.nodes.size()).second)
            lines.fail("node " + fields[0] + " occurs twice.");
          file.nodes.emplace_back(lines.real(fields[1]), lines.real(fields[2]),
                                  lines.real(fields[3]));
          if (!set.empty())
            node_sets[set].numbers.insert(number);
        };
      }

      void begin_elements()
      {
        const std::string type                            = need_option("TYPE");
        static const std::set<std::string> hex            = {"C3D8", "C3D8R", "C3D8I"},
                                           quadrilaterals = {"S4",   "S4R",   "M3D4",   "M3D4R",
                                                             "CPS4", "CPS4R", "SFM3D4", "SFM3D4R"},
                                           passed_over    = {"T3D2", "B31", "B32", "T3D3", "MASS"};
        if (passed_over.count(type))
          return;
        if (!hex.count(type) && !quadrilaterals.count(type))
          lines.fail("elements of type " + type +
                     "; allowed are the linear hexahedra C3D8, C3D8R, C3D8I, and on their faces "
                     "the quadrilaterals S4, S4R, M3D4, CPS4, SFM3D4, which only name them.");
        n_nodes     = hex.count(type) ? 8 : 4;
        element_set = options.count("ELSET") ? options["ELSET"] : "";
        take        = [this](const std::vector<std::string> &fields)
        {
          for (const std::string &field : fields)
            if (!field.empty())
              element.push_back(lines.integer(field));
          if (element.size() > n_nodes)
            finish_element();
        };
      }

      /// Number and nodes of an element are complete.
      void finish_element()
      {
        if (element.empty())
          return;
        const std::string number = std::to_string(element[0]);
        if (element.size() != n_nodes + 1)
          lines.fail("element " + number + " should have " + std::to_string(n_nodes) +
                     " nodes, not " + std::to_string(element.size() - 1) + ".");
        MeshFile::Cell cell{{}, element[0]};
        for (unsigned int v = 0; v < n_nodes; ++v)
        {
          const auto node = node_numbers.find(element[v + 1]);
          if (node == node_numbers.end())
            lines.fail("element " + number + " has the unknown node " +
                       std::to_string(element[v + 1]) + ".");
          cell.nodes[v] = node->second;
        }
        bool is_new = false;
        if (n_nodes == 8)
        {
          is_new = cell_numbers.emplace(element[0], file.cells.size()).second;
          file.cells.push_back(cell);
        }
        else
        {
          MeshFile::Face face = {{cell.nodes[0], cell.nodes[1], cell.nodes[2], cell.nodes[3]}};
          std::sort(face.begin(), face.end());
          is_new = faces.emplace(element[0], face).second;
        }
        if (!is_new || cell_numbers.count(element[0]) + faces.count(element[0]) > 1)
          lines.fail("element " + number + " occurs twice.");
        if (!element_set.empty())
          element_sets[element_set].numbers.insert(element[0]);
        element.clear();
      }

      void begin_set(const bool of_elements)
      {
        auto &sets             = of_elements ? element_sets : node_sets;
        const std::string name = need_option(of_elements ? "ELSET" : "NSET");
        NumberSet &set         = sets[name];
        const bool generate    = options.count("GENERATE");
        take = [this, &sets, &set, generate](const std::vector<std::string> &fields)
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
            set.ranges.insert(std::array<long, 3>{{first, last, step}});
            return;
          }
          for (const std::string &field : fields)
            if (is_number(field))
              set.numbers.insert(lines.integer(field));
            else if (!field.empty())
            {
              const auto other = sets.find(label(field));
              if (other == sets.end())
                lines.fail("the set " + field + " is not known here.");
              set.insert(other->second);
            }
        };
      }

      void begin_surface()
      {
        const std::string name = need_option("NAME");
        const std::string type = options.count("TYPE") ? options["TYPE"] : "ELEMENT";
        if (type != "ELEMENT" && type != "NODE")
          lines.fail("*SURFACE, TYPE=" + type + ": allowed are ELEMENT and NODE.");
        const bool of_nodes = type == "NODE";
        take                = [this, name, of_nodes](const std::vector<std::string> &fields)
        {
          const auto members = [&](const std::map<std::string, NumberSet> &sets)
          {
            if (is_number(fields[0]))
              return NumberSet{{lines.integer(fields[0])}, {}};
            const auto set = sets.find(label(fields[0]));
            if (set == sets.end())
              lines.fail("the set " + fields[0] + " is not known here.");
            return set->second;
          };
          if (of_nodes)
          {
            node_sets[name].insert(members(node_sets));
            return;
          }
          // Abaqus' faces S1 ... S6 of a hexahedron
          const std::string face = fields.size() > 1 ? capitals(fields[1]) : "";
          if (face.size() != 2 || face[0] != 'S' || face[1] < '1' || face[1] > '6')
            lines.fail("expected an element or a set and one of its faces S1 to S6.");
          const NumberSet elements = members(element_sets);
          const auto add           = [&](const long element)
          {
            const auto cell = cell_numbers.find(element);
            if (cell == cell_numbers.end())
              lines.fail("element " + std::to_string(element) + " is no hexahedron of this file.");
            file.surfaces[name].push_back(file.face(cell->second, face[1] - '1'));
          };
          for (const long element : elements.numbers)
            add(element);
          // The first that does not exist ends it.
          for (const auto &[first, last, step] : elements.ranges)
            for (long k = 0; k <= (last - first) / step; ++k)
              add(first + k * step);
        };
      }

      /// Sets of elements become volumes or surfaces.
      void resolve()
      {
        for (const auto &[name, elements] : element_sets)
        {
          for (const long element : elements.members_of(cell_numbers))
            file.volumes[name].push_back(cell_numbers.at(element));
          for (const long element : elements.members_of(faces))
            file.surfaces[name].push_back(faces.at(element));
        }
        for (const auto &[name, nodes] : node_sets)
          for (const long node : nodes.members_of(node_numbers))
            file.node_sets[name].push_back(node_numbers.at(node));
      }

      LineReader lines;
      MeshFile &file;
      std::string keyword;
      std::map<std::string, std::string> options;
      std::function<void(const std::vector<std::string> &)> take;

      unsigned int n_nodes = 0;
      std::string element_set;
      std::vector<long> element; ///< number and nodes so far
      std::unordered_map<long, unsigned int> node_numbers, cell_numbers;
      std::unordered_map<long, MeshFile::Face> faces;
      std::map<std::string, NumberSet> element_sets, node_sets;
    };
  } // namespace

  void read_abaqus(std::istream &in, MeshFile &file)
  {
    AbaqusReader(in, file).read();
  }
} // namespace squeal
