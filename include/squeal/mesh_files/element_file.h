#pragma once

#include <squeal/mesh_files/mesh_file.h>

#include <functional>

namespace squeal
{
  /// A mesh as a file has it: solid elements of several shapes, linear or quadratic, and groups by
  /// name. Lengths in units of the file.
  struct ElementFile
  {
    /// Corners of a face in cyclic order; a triangle has three.
    using Face                         = std::array<unsigned int, 4>;
    static constexpr unsigned int none = -1; ///< the fourth corner of a triangle

    struct Element
    {
      ElementShape shape;
      /// Corners, then the middles of the edges, of the quadrilaterals and of the element, as far
      /// as there are any, in the order of the tables below.
      std::vector<unsigned int> nodes;
      long number;
      unsigned int line; ///< in the file

      bool is_quadratic() const;
      /// Order and shape in words.
      std::string kind() const;
    };

    std::string name;
    std::vector<dealii::Point<3>> nodes;
    std::vector<Element> elements;
    std::map<std::string, std::vector<unsigned int>> volumes;   ///< elements by name
    std::map<std::string, std::vector<Face>> surfaces;          ///< faces by name
    std::map<std::string, std::vector<unsigned int>> node_sets; ///< as in MeshFile
    std::map<std::string, unsigned int> passed_over;            ///< elements by type of the file

    /// Corners of a shape.
    static unsigned int n_corners(ElementShape shape);
    /// The edges of a shape, as pairs of corners in the order of Abaqus' middle nodes.
    static const std::vector<std::array<unsigned int, 2>> &edges(ElementShape shape);
    /// The faces of a shape in the order of Abaqus' S1, S2, ..., by corners, triangles with none.
    static const std::vector<Face> &faces(ElementShape shape);
    /// Face @p f of an element by nodes.
    Face face(const Element &element, unsigned int f) const;
    /// Its nodes in ascending order: the same for all elements that have the face.
    static Face ascending(Face face);
    /// The faces that one element alone has, by their nodes in ascending order.
    std::map<Face, Face> free_faces() const;
    /// Throws an InputError that says where the element stands.
    [[noreturn]] void fail(const Element &element, const std::string &message) const;
    [[noreturn]] void fail_beside_another(const Element &element) const;
  };

  /// Divides every element into eight of its shape, with middle nodes where it has some. New nodes
  /// lie where the element's polynomial of degree 2 has them, or on circles about the z axis in
  /// elements for which @p follows_circles, by number. Groups become those of the parts; sets of
  /// nodes keep their nodes. Throws InputError where neighbours are curved differently.
  ElementFile refine(const ElementFile &elements,
                     const std::function<bool(unsigned int)> &follows_circles);

  /// Hexahedra of a file: a tetrahedron becomes four, with the centres of its edges, its faces and
  /// itself, a wedge three. What shares an edge that is halved by that, or lies across a
  /// quadrilateral from one, is halved in that direction, too; other hexahedra stay whole. New
  /// corners lie where the element's polynomial of degree 2 has them, and cells have its shape
  /// (theory.md, section 8). In elements for which @p follows_circles, by number, corners lie on
  /// circles about the z axis, as the cells will, and hexahedra that are bent otherwise become
  /// eight. With @p keep_own displacements on divided elements are to stay the elements' own
  /// polynomials. Groups become those of the parts. Throws InputError for elements that are flat or
  /// folded, with number and line.
  MeshFile divide(const ElementFile &elements,
                  const std::function<bool(unsigned int)> &follows_circles, bool keep_own = false);
} // namespace squeal
