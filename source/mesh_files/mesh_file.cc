#include <squeal/base/errors.h>
#include <squeal/base/files.h>
#include <squeal/base/text.h>
#include <squeal/mesh_files/element_file.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

namespace squeal
{
  const std::array<std::array<unsigned int, 4>, 6> MeshFile::cell_faces = {{{{0, 1, 2, 3}},
                                                                            {{4, 7, 6, 5}},
                                                                            {{0, 4, 5, 1}},
                                                                            {{1, 5, 6, 2}},
                                                                            {{2, 6, 7, 3}},
                                                                            {{3, 7, 4, 0}}}};

  MeshFile::Face MeshFile::face(const unsigned int c, const unsigned int f) const
  {
    Face corners;
    for (unsigned int v = 0; v < 4; ++v)
      corners[v] = cells[c].nodes[cell_faces[f][v]];
    std::sort(corners.begin(), corners.end());
    return corners;
  }

  std::vector<std::string> words_of(const std::string &text)
  {
    std::istringstream in(text);
    std::vector<std::string> words;
    for (std::string word; in >> word;)
      words.push_back(word);
    return words;
  }

  bool LineReader::next(std::string &line)
  {
    if (!std::getline(in, line))
      return false;
    ++number;
    const std::size_t first = line.find_first_not_of(" \t\r"),
                      last  = line.find_last_not_of(" \t\r");
    line = first == std::string::npos ? "" : line.substr(first, last - first + 1);
    return true;
  }

  std::string LineReader::need(const std::string &wanted)
  {
    std::string line;
    if (!next(line))
      fail("the file ends where " + wanted + " should be.");
    return line;
  }

  std::vector<std::string> LineReader::need_words(const std::size_t n_words,
                                                  const std::string &wanted)
  {
    const std::string line               = need(wanted);
    const std::vector<std::string> words = words_of(line);
    if (words.size() < n_words)
      fail("expected " + wanted + ", found '" + line.substr(0, 60) + "'.");
    return words;
  }

  long LineReader::integer(const std::string &word) const
  {
    std::size_t end = 0;
    long value      = 0;
    try
    {
      value = std::stol(word, &end);
    }
    catch (const std::exception &)
    {
      end = 0;
    }
    // The smallest has no absolute value.
    if (end == 0 || end != word.size() || value == std::numeric_limits<long>::min())
      fail("'" + word.substr(0, 60) + "' is not an integer.");
    return value;
  }

  std::size_t LineReader::count(const std::string &word) const
  {
    const long value = integer(word);
    if (value < 0)
      fail("'" + word.substr(0, 60) + "' is negative; a number of things is expected.");
    return value;
  }

  double LineReader::real(const std::string &word) const
  {
    const std::optional<double> value = decimal_number(word);
    if (!value)
      fail("'" + word.substr(0, 60) + "' is not a number.");
    return *value;
  }

  void LineReader::fail(const std::string &message) const
  {
    throw InputError("Mesh/File: " + filename + ", line " + std::to_string(number) + ": " +
                     message);
  }

  namespace
  {
    /// Faces of the boundary that the node sets stand for, by their corners. A node set without a
    /// whole face is dropped.
    void faces_of_node_sets(ElementFile &file)
    {
      if (file.node_sets.empty())
        return;
      const std::map<ElementFile::Face, ElementFile::Face> free = file.free_faces();
      for (const auto &[name, nodes] : file.node_sets)
      {
        std::vector<bool> is_in(file.nodes.size());
        for (const unsigned int node : nodes)
          is_in[node] = true;
        std::vector<ElementFile::Face> faces;
        for (const auto &[ascending, face] : free)
          if (std::all_of(ascending.begin(), ascending.end(),
                          [&](const auto node)
                          { return node == ElementFile::none || is_in[node]; }))
            faces.push_back(face);
        if (!faces.empty() && file.surfaces.count(name) == 0)
          file.surfaces[name] = faces;
      }
    }

    /// What makes a mesh file of files with other endings, as far as they are known.
    std::string what_to_do_with(std::string ending)
    {
      for (char &c : ending)
        c = std::tolower(static_cast<unsigned char>(c));
      for (const char *of_geometry :
           {".stp", ".step", ".igs", ".iges", ".brep", ".stl", ".x_t", ".geo"})
        if (ending == of_geometry)
          return " This is a geometry without a mesh: mesh it first, for example by Gmsh.";
      for (const char *of_mesh :
           {".cdb", ".bdf", ".nas", ".dat", ".k", ".unv", ".vtk", ".vtu", ".med"})
        if (ending == of_mesh)
          return " Write this mesh as one of these.";
      return "";
    }

    void sort_unique(std::vector<unsigned int> &list)
    {
      std::sort(list.begin(), list.end());
      list.erase(std::unique(list.begin(), list.end()), list.end());
    }
  } // namespace

  ElementFile read_mesh_file(const std::string &filename)
  {
    const std::filesystem::path path(filename);
    const std::string ending = path.extension().string();
    if (ending != ".msh" && ending != ".inp")
      throw InputError("Mesh/File = " + filename +
                       ": the ending tells the format; allowed are .msh (Gmsh 2.2 or 4.1, text) "
                       "and .inp (Abaqus, CalculiX)." +
                       what_to_do_with(ending));
    std::ifstream in = open_regular_file(filename);
    if (!in.is_open())
    {
      std::error_code impossible; // as of a name that is too long
      const std::string script = std::filesystem::path(path).replace_extension(".geo").string(),
                        here   = filename[0] == '-' ? "./" : ""; // no options of Gmsh
      throw InputError("Mesh/File = " + filename + ": the file cannot be read." +
                       (std::filesystem::exists(script, impossible)
                            ? " Make it: gmsh -3 " + here + script + " -o " + here + filename
                            : " Names are relative to the directory in which squeal is started."));
    }
    ElementFile file;
    file.name = filename;
    ending == ".msh" ? read_gmsh(in, file) : read_abaqus(in, file);
    if (file.elements.empty())
      throw InputError("Mesh/File = " + filename + ": there are no solid elements in it." +
                       (ending == ".msh"
                            ? " Gmsh writes only elements of physical groups: the volumes need "
                              "Physical Volume(\"name\")."
                            : " Shells, membranes and beams are no bodies here: mesh their volumes "
                              "with solids, C3D4, C3D8, C3D10, C3D20 and the like."));
    faces_of_node_sets(file);
    for (auto &[name, elements] : file.volumes)
      sort_unique(elements);
    return file;
  }
} // namespace squeal
