#pragma once

#include <squeal/assessment/stability.h>
#include <squeal/contact/contact_zone.h>
#include <squeal/run/refinement.h>

#include <optional>
#include <string>
#include <vector>

namespace squeal
{
  /// What a run over several meshes needs to go on after it was ended: what it found on each mesh,
  /// and which cells it divided. The meshes are made anew by dividing the same cells in the same
  /// order, so that all numbers of cells and unknowns, and with them the digits, are the same.
  struct Checkpoint
  {
    struct Cycle
    {
      std::vector<ModeRow> rows;
      unsigned int n_unknowns = 0;
      double seconds = 0, memory_gib = 0;
      CellNames divided_cells; ///< to make the next mesh
    };
    /// Cells divided at the contact's edge before the first mesh, one list after the other.
    std::vector<CellNames> divided_at_edge;
    std::vector<Cycle> cycles; ///< finished ones
    ContactZone zone;          ///< of the last mesh: the next one begins with it
    bool finished = false;     ///< there is no further mesh; a sweep follows

    /// Writes refinement.state in the directory, with the sizes of the tables that grow from cycle
    /// to cycle. Collective; throws std::runtime_error.
    void save(const std::string &directory, MPI_Comm comm) const;

    /// Reads it and cuts the tables to their sizes; nothing if there is no such file. Collective.
    static std::optional<Checkpoint> resume(const std::string &directory, MPI_Comm comm);

    /// Removes the file: the run is complete. Collective.
    static void remove(const std::string &directory, MPI_Comm comm);
  };
} // namespace squeal
