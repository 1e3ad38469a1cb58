#pragma once

#include <squeal/mesh/mortar.h>
#include <squeal/mesh_files/mesh_file.h>
#include <squeal/parameters/parameters.h>

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace squeal
{
  /// Returns what is equal of names that capitals alone tell apart, as they are in a mesh file.
  std::string plain_capitals(const std::string &name);

  /// A mesh file in metres with the axis z: its cells, which of them share a face, and what its
  /// groups are used for. Refuses what no scene can be made of.
  class ImportedMesh
  {
  public:
    using Face = MeshFile::Face;
    struct CellFace
    {
      unsigned int cell, face;
    };

    /// Reads the mesh of the section Mesh.
    explicit ImportedMesh(const Parameters::All &prm);

    /// Turns cells that are numbered as their mirror image, refuses distorted ones, and finds the
    /// cells of each face.
    void connect_cells();

    /// Throws InputError: a key, of the section Mesh where it names no other one, and the file.
    [[noreturn]] void fail(const std::string &key, const std::string &message) const;
    /// A cell for messages.
    std::string element(unsigned int cell) const;

    /// The group of a name, which a key has; where capitals are the only difference, that.
    const std::pair<const std::string, std::vector<unsigned int>> &
    volume(const std::string &name, const std::string &key) const;
    const std::pair<const std::string, std::vector<Face>> &surface(const std::string &name,
                                                                   const std::string &key) const;

    /// The cell of a face that must be on the boundary; name and key of its group for messages.
    CellFace boundary_cell(const Face &face, const std::string &name, const std::string &key) const;

    /// A face as a surface patch of degree 1 whose normal points out of its cell, and those of a
    /// surface, by its name in the file.
    SurfaceFace<3> patch(const Face &face) const;
    std::vector<SurfaceFace<3>> patches(const std::string &name) const;

    /// The nine points, x first, of a face whose cell middle nodes bend, else none.
    std::vector<dealii::Point<3>> bent_patch(const Face &face) const;

    MeshFile file;
    std::map<Face, std::vector<CellFace>> faces;
    unsigned int n_turned = 0;                ///< cells numbered inside out in the file
    std::map<std::string, std::string> roles; ///< of volume and surface groups: keys

  private:
    void turn_cells();
    /// A face between two cells lies on opposite sides of them.
    void find_neighbours();
    template <typename T>
    const std::pair<const std::string, T> &
    find_group(const std::map<std::string, T> &groups, const std::string &name,
               const std::string &key, const std::string &kind) const;
  };

  /// What a mesh file calls the axes x, y, z of the scene, whose z is Mesh/Axis.
  std::string axes_in_file(const Parameters::Mesh &mesh);
} // namespace squeal
