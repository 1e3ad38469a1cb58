#include <squeal/base/errors.h>
#include <squeal/base/text.h>
#include <squeal/mesh_files/element_file.h>

#include <algorithm>
#include <unordered_map>

namespace squeal
{
  namespace
  {
    /// One file: http://gmsh.info, "MSH file format", versions 2.2 and 4.1 in ASCII.
    class GmshReader
    {
    public:
      GmshReader(std::istream &in, ElementFile &file) : lines(in, file.name), file(file) {}

      void read()
      {
        for (std::string line; lines.next(line);)
        {
          if (line.empty() || line[0] != '$')
            continue;
          if (line == "$MeshFormat")
            read_format();
          else if (version == 0)
            lines.fail("$MeshFormat must come first, not '" + line.substr(0, 60) + "'.");
          else if (line == "$PhysicalNames")
            read_names();
          else if (line == "$Entities")
            read_entities();
          else if (line == "$Nodes")
            version == 2 ? read_nodes_2() : read_nodes_4();
          else if (line == "$Elements")
            version == 2 ? read_elements_2() : read_elements_4();
          else if (line.rfind("$Partitioned", 0) == 0)
            lines.fail("the mesh is partitioned; write it as one part.");
          else if (line.rfind("$End", 0) != 0)
            skip(line);
        }
        if (version == 0)
          lines.fail("there is no $MeshFormat: this is not a Gmsh file.");
      }

    private:
      using Tags = std::vector<long>; ///< physical tags

      void read_format()
      {
        const auto words = lines.need_words(3, "version, file type and data size");
        if (words[0] != "2.2" && words[0] != "4.1")
          lines.fail("the format's version is " + words[0] +
                     "; allowed are 2.2 and 4.1 (gmsh -format msh22 or msh41).");
        if (words[1] != "0")
          lines.fail("the file is binary; text is needed (in Gmsh Mesh.Binary = 0).");
        version = words[0] == "2.2" ? 2 : 4;
        end("$EndMeshFormat");
      }

      void end(const std::string &mark)
      {
        const std::string line = lines.need(mark);
        if (line != mark)
          lines.fail("expected " + mark + ", found '" + line.substr(0, 60) + "'.");
      }

      void skip(const std::string &section)
      {
        const std::string mark = "$End" + section.substr(1);
        while (lines.need(mark) != mark)
          ;
      }

      std::size_t need_count(const std::string &wanted)
      {
        return lines.count(lines.need_words(1, wanted)[0]);
      }

      void read_names()
      {
        const std::size_t n = need_count("the number of physical names");
        for (std::size_t i = 0; i < n; ++i)
        {
          const std::string line  = lines.need("a physical name");
          const auto words        = words_of(line);
          const std::size_t first = line.find('"'), last = line.rfind('"');
          if (words.size() < 3 || first == last)
            lines.fail("expected dimension, tag and \"name\", found '" + line.substr(0, 60) + "'.");
          names[{lines.integer(words[0]), lines.integer(words[1])}] =
              plain_name(line.substr(first + 1, last - first - 1));
        }
        end("$EndPhysicalNames");
      }

      /// The physical tags of each entity.
      void read_entities()
      {
        const auto counts = lines.need_words(4, "the numbers of entities");
        for (long dim = 0; dim < 4; ++dim)
          for (std::size_t i = 0, n = lines.count(counts[dim]); i < n; ++i)
          {
            // A point has three coordinates, the others the corners of a box.
            const std::size_t at = dim == 0 ? 4 : 7;
            const auto words     = lines.need_words(at + 1, "an entity");
            const std::size_t k  = lines.count(words[at]);
            if (words.size() < at + 1 + k)
              lines.fail("an entity has fewer physical tags than it says.");
            for (std::size_t j = 0; j < k; ++j)
              physical[{dim, lines.integer(words[0])}].push_back(
                  std::abs(lines.integer(words[at + 1 + j])));
          }
        end("$EndEntities");
      }

      void add_node(const long tag, const std::vector<std::string> &words, const std::size_t from)
      {
        if (!node_numbers.emplace(tag, file.nodes.size()).second)
          lines.fail("node " + std::to_string(tag) + " occurs twice.");
        file.nodes.emplace_back(lines.real(words[from]), lines.real(words[from + 1]),
                                lines.real(words[from + 2]));
      }

      void read_nodes_2()
      {
        const std::size_t n = need_count("the number of nodes");
        for (std::size_t i = 0; i < n; ++i)
        {
          const auto words = lines.need_words(4, "a node's number and coordinates");
          add_node(lines.integer(words[0]), words, 1);
        }
        end("$EndNodes");
      }

      void read_nodes_4()
      {
        const std::size_t n_blocks = need_count("the numbers of blocks and nodes");
        for (std::size_t b = 0; b < n_blocks; ++b)
        {
          const auto block    = lines.need_words(4, "a block of nodes");
          const std::size_t n = lines.count(block[3]);
          std::vector<long> tags;
          for (std::size_t i = 0; i < n; ++i)
            tags.push_back(lines.integer(lines.need_words(1, "a node's number")[0]));
          for (const long tag : tags)
            add_node(tag, lines.need_words(3, "a node's coordinates"), 0);
        }
        end("$EndNodes");
      }

      void read_elements_2()
      {
        const std::size_t n = need_count("the number of elements");
        for (std::size_t i = 0; i < n; ++i)
        {
          const auto words         = lines.need_words(3, "an element");
          const std::size_t n_tags = lines.count(words[2]);
          if (n_tags == 0 || words.size() < 4)
            lines.fail("element " + words[0] + " has no physical tag.");
          Tags tags;
          if (const long tag = lines.integer(words[3]); tag != 0)
            tags.push_back(tag);
          add_element(lines.integer(words[0]), lines.integer(words[1]), tags, words, 3 + n_tags);
        }
        end("$EndElements");
      }

      void read_elements_4()
      {
        const std::size_t n_blocks = need_count("the numbers of blocks and elements");
        for (std::size_t b = 0; b < n_blocks; ++b)
        {
          const auto block    = lines.need_words(4, "a block of elements");
          const long type     = lines.integer(block[2]);
          const std::size_t n = lines.count(block[3]);
          const Tags &tags    = physical[{lines.integer(block[0]), lines.integer(block[1])}];
          for (std::size_t i = 0; i < n; ++i)
          {
            const auto words = lines.need_words(1, "an element");
            add_element(lines.integer(words[0]), type, tags, words, 1);
          }
        }
        end("$EndElements");
      }

      std::string name_of(const long dim, const long tag) const
      {
        const auto name = names.find({dim, tag});
        return name == names.end() ? std::to_string(tag) : name->second;
      }

      /// A type of Gmsh: how many corners name a face, or which of its nodes are those of a solid
      /// element in our order (Gmsh's manual, "Node ordering").
      struct Type
      {
        unsigned int n_nodes;
        unsigned int n_corners; ///< of a face
        ElementShape shape;
        std::vector<unsigned int> order;
      };

      static const std::map<long, Type> &types()
      {
        constexpr ElementShape tetrahedron = ElementShape::tetrahedron, wedge = ElementShape::wedge,
                               hexahedron       = ElementShape::hexahedron;
        static const std::map<long, Type> table = {
            {2, {3, 3, {}, {}}},
            {3, {4, 4, {}, {}}},
            {9, {6, 3, {}, {}}},
            {10, {9, 4, {}, {}}},
            {16, {8, 4, {}, {}}},
            {4, {4, 0, tetrahedron, {0, 1, 2, 3}}},
            {6, {6, 0, wedge, {0, 1, 2, 3, 4, 5}}},
            {5, {8, 0, hexahedron, {0, 1, 2, 3, 4, 5, 6, 7}}},
            {11, {10, 0, tetrahedron, {0, 1, 2, 3, 4, 5, 6, 7, 9, 8}}},
            {18, {15, 0, wedge, {0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11}}},
            {13, {18, 0, wedge, {0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11, 15, 17, 16}}},
            {17, {20, 0, hexahedron, {0,  1, 2,  3,  4,  5,  6,  7,  8,  11,
                                      13, 9, 16, 18, 19, 17, 10, 12, 14, 15}}},
            {12, {27, 0, hexahedron, {0,  1,  2,  3,  4,  5,  6,  7,  8,  11, 13, 9,  16, 18,
                                      19, 17, 10, 12, 14, 15, 20, 25, 21, 23, 24, 22, 26}}}};
        return table;
      }

      void add_element(const long number, const long type, const Tags &tags,
                       const std::vector<std::string> &words, const std::size_t first)
      {
        constexpr long line_2 = 1, line_3 = 8, point = 15;
        if (type == line_2 || type == line_3 || type == point)
          return;
        const auto known = types().find(type);
        if (known == types().end())
          refuse(number, type);
        const auto &[n, n_corners, shape, order] = known->second;
        if (words.size() < first + n)
          lines.fail("element " + std::to_string(number) + " has too few nodes.");
        std::vector<unsigned int> nodes(n);
        for (std::size_t v = 0; v < n; ++v)
        {
          const auto node = node_numbers.find(lines.integer(words[first + v]));
          if (node == node_numbers.end())
            lines.fail("element " + std::to_string(number) + " has the unknown node " +
                       words[first + v] + ".");
          nodes[v] = node->second;
        }
        if (n_corners == 0)
        {
          // Version 2.2 repeats an element for each of its groups.
          auto sorted = nodes;
          std::sort(sorted.begin(), sorted.end());
          const unsigned int cell = cells.emplace(sorted, file.elements.size()).first->second;
          if (cell == file.elements.size())
          {
            ElementFile::Element element{shape, {}, number, lines.line_number()};
            for (const unsigned int v : order)
              element.nodes.push_back(nodes[v]);
            file.elements.push_back(element);
          }
          for (const long tag : tags)
            file.volumes[name_of(3, tag)].push_back(cell);
          return;
        }
        const ElementFile::Face face = {
            {nodes[0], nodes[1], nodes[2], n_corners == 4 ? nodes[3] : ElementFile::none}};
        for (const long tag : tags)
          file.surfaces[name_of(2, tag)].push_back(face);
      }

      [[noreturn]] void refuse(const long number, const long type) const
      {
        static const std::map<long, std::string> kinds = {
            {7, "a pyramid"}, {14, "a quadratic pyramid"}, {19, "a quadratic pyramid"}};
        const auto kind = kinds.find(type);
        lines.fail("element " + std::to_string(number) + " is " +
                   (kind == kinds.end() ? "of Gmsh's type " + std::to_string(type) : kind->second) +
                   "; allowed are tetrahedra, prisms and hexahedra and their faces, with "
                   "Mesh.ElementOrder 1 or 2.");
      }

      LineReader lines;
      ElementFile &file;
      int version = 0;
      std::map<std::pair<long, long>, std::string> names; ///< by dimension and tag
      std::map<std::pair<long, long>, Tags> physical;     ///< by dimension and entity
      std::unordered_map<long, unsigned int> node_numbers;
      std::map<std::vector<unsigned int>, unsigned int> cells; ///< elements by sorted nodes
    };
  } // namespace

  void read_gmsh(std::istream &in, ElementFile &file)
  {
    GmshReader(in, file).read();
  }
} // namespace squeal
