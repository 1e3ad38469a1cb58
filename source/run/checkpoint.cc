#include <squeal/base/archive.h>
#include <squeal/base/state_file.h>
#include <squeal/run/checkpoint.h>

namespace squeal
{
  namespace
  {
    const std::vector<std::string> tables = {"modes.csv",         "cycles.csv", "contributions.csv",
                                             "sensitivities.csv", "static.csv", "wear.csv",
                                             "bars.csv"};

    StateFile state_file(const std::string &directory)
    {
      return {directory, "refinement", tables};
    }
  } // namespace

  /// Hands over the parts of a row that a later mesh is compared with.
  void serialize(Archive &archive, ModeRow &row)
  {
    archive(row.cycle, row.mode, row.lambda, row.verdict, row.parity, row.growth_rate_error,
            row.frequency_error, row.corrected, row.condition_number, row.backward_error,
            row.left_backward_error, row.d, row.g, row.k, row.n, row.rayleigh_defect,
            row.criterion);
  }

  void serialize(Archive &archive, ContactZone::Interface &interface)
  {
    archive(interface.closed, interface.open);
  }

  void serialize(Archive &archive, Checkpoint::Cycle &cycle)
  {
    archive(cycle.n_unknowns, cycle.seconds, cycle.memory_gib, cycle.rows, cycle.divided_cells);
  }

  void serialize(Archive &archive, Checkpoint &record)
  {
    archive(record.finished, record.divided_at_edge, record.zone.interfaces, record.cycles);
  }

  void Checkpoint::save(const std::string &directory, const MPI_Comm comm) const
  {
    state_file(directory).save(numbers_of(*this), comm);
  }

  std::optional<Checkpoint> Checkpoint::resume(const std::string &directory, const MPI_Comm comm)
  {
    const std::optional<std::vector<double>> numbers = state_file(directory).resume(comm);
    return numbers ? record_of<Checkpoint>(*numbers) : std::nullopt;
  }

  void Checkpoint::remove(const std::string &directory, const MPI_Comm comm)
  {
    state_file(directory).remove(comm);
  }
} // namespace squeal
