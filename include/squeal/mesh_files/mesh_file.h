#pragma once

#include <squeal/mesh/own_elements.h>
#include <squeal/mesh/quadratic_cells.h>

#include <deal.II/base/point.h>

#include <array>
#include <istream>
#include <map>
#include <string>
#include <vector>

namespace squeal
{
  struct ElementFile;

  /// What became of a file's elements, for the report.
  struct Division
  {
    std::map<std::string, unsigned int> n_elements;  ///< by kind
    unsigned int n_nodes            = 0;             ///< that elements have
    unsigned int n_divided          = 0;             ///< elements of which more than one cell is
    unsigned int n_curved           = 0;             ///< elements that bend their cells
    unsigned int n_linear_simplices = 0;             ///< tetrahedra and wedges without middle nodes
    std::map<std::string, unsigned int> passed_over; ///< elements by type of the file
  };

  /// A hexahedral mesh: nodes, cells, and groups by name. Lengths in units of the file.
  struct MeshFile
  {
    /// The corners of a quadrilateral as numbers of nodes, ascending.
    using Face = std::array<unsigned int, 4>;
    struct Cell
    {
      /// Four around the bottom, four around the top, as both formats have them.
      std::array<unsigned int, 8> nodes;
      long number; ///< in the file
    };

    std::string name;
    std::vector<dealii::Point<3>> nodes;
    std::vector<Cell> cells;
    std::map<std::string, std::vector<unsigned int>> volumes; ///< cells by name
    std::map<std::string, std::vector<Face>> surfaces;        ///< faces by name
    /// Nodes by name: these stand for the faces of the boundary all of whose corners are among
    /// them.
    std::map<std::string, std::vector<unsigned int>> node_sets;
    QuadraticCells quadratic; ///< the shapes of cells that middle nodes bend, by node
    /// Elements that keep their own polynomials; vertices in the order of the cells' nodes.
    OwnElements own;
    Division division;

    /// The faces of a cell: bottom, top, then around; corners in cyclic order, seen from outside
    /// clockwise or all counter-clockwise.
    static const std::array<std::array<unsigned int, 4>, 6> cell_faces;
    /// Corners @p f of cell @p c in ascending order.
    Face face(unsigned int c, unsigned int f) const;
  };

  /// Reads a mesh by the ending of its name: .msh (Gmsh 2.2 or 4.1 text) or .inp (Abaqus,
  /// CalculiX). Throws InputError with file and line, for everything that is not understood and
  /// for solid elements other than tetrahedra, wedges and hexahedra of degree 1 and 2.
  ElementFile read_mesh_file(const std::string &filename);

  // The formats. @p file has a name and nothing else.
  void read_gmsh(std::istream &in, ElementFile &file);
  void read_abaqus(std::istream &in, ElementFile &file);

  /// Lines of a text file with their numbers; turns words into numbers. Throws InputError with
  /// file and line.
  class LineReader
  {
  public:
    LineReader(std::istream &in, const std::string &filename) : filename(filename), in(in) {}
    virtual ~LineReader() = default;

    /// The next line without blanks at its ends and the end-of-line of other systems; false at the
    /// end of the file.
    virtual bool next(std::string &line);
    /// The next line, which must exist; @p wanted says what.
    std::string need(const std::string &wanted);
    /// The words of the next line, at least @p n_words.
    std::vector<std::string> need_words(std::size_t n_words, const std::string &wanted);
    long integer(const std::string &word) const;
    /// Not negative.
    std::size_t count(const std::string &word) const;
    double real(const std::string &word) const;
    [[noreturn]] void fail(const std::string &message) const;

    /// The number of the line that was read last.
    unsigned int line_number() const
    {
      return number;
    }

  protected:
    std::string filename; ///< of the line that was read last, and its number
    unsigned int number = 0;

  private:
    std::istream &in;
  };

  /// The words of a text between blanks.
  std::vector<std::string> words_of(const std::string &text);
} // namespace squeal
