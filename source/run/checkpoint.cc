#include <squeal/base/files.h>
#include <squeal/base/log.h>
#include <squeal/run/checkpoint.h>

#include <algorithm>
#include <filesystem>

namespace squeal
{
  namespace
  {
    const std::vector<std::string> tables = {"modes.csv", "cycles.csv", "contributions.csv",
                                             "sensitivities.csv", "static.csv"};

    std::string state_file(const std::string &directory)
    {
      return directory + "/refinement.state";
    }

    /// Hands every number of a record, in one order, to save or to fill in.
    template <typename Visit>
    void visit_row(ModeRow &row, const Visit &visit)
    {
      const auto visit_complex = [&](std::complex<double> &z)
      {
        double re = z.real(), im = z.imag();
        visit(re);
        visit(im);
        z = {re, im};
      };
      const auto visit_optional = [&](auto &value)
      {
        double is_known = value.has_value();
        visit(is_known);
        auto inner = value.value_or(typename std::decay_t<decltype(value)>::value_type());
        if constexpr (std::is_same_v<decltype(inner), double>)
          visit(inner);
        else
          visit_complex(inner);
        if (is_known != 0)
          value = inner;
        else
          value.reset();
      };
      double cycle = row.cycle, mode = row.mode;
      visit(cycle);
      visit(mode);
      row.cycle = cycle;
      row.mode  = mode;
      visit_complex(row.lambda);
      const auto visit_choice = [&](auto &value)
      {
        double number = static_cast<unsigned int>(value);
        visit(number);
        using Choice = std::decay_t<decltype(value)>;
        value = number >= 0 && number < names_of(value).size() ? Choice(int(number)) : Choice();
      };
      visit_choice(row.verdict);
      visit_choice(row.parity);
      visit_optional(row.growth_rate_error);
      visit_optional(row.frequency_error);
      visit_optional(row.corrected);
      visit_optional(row.condition_number);
      for (double ModeRow::*value :
           {&ModeRow::backward_error, &ModeRow::left_backward_error, &ModeRow::d, &ModeRow::g,
            &ModeRow::k, &ModeRow::n, &ModeRow::rayleigh_defect, &ModeRow::criterion})
        visit(row.*value);
    }

    template <typename Visit>
    void visit_record(Checkpoint &record, const Visit &visit)
    {
      const auto visit_number = [&](auto &value)
      {
        double number = value;
        visit(number);
        value = number;
      };
      const auto visit_size = [&](auto &list)
      {
        std::size_t size = list.size();
        visit_number(size);
        list.resize(size);
      };
      visit_number(record.finished);
      visit_size(record.cycles);
      for (Checkpoint::Cycle &cycle : record.cycles)
      {
        visit_number(cycle.n_unknowns);
        visit_number(cycle.seconds);
        visit_number(cycle.memory_gib);
        visit_size(cycle.rows);
        for (ModeRow &row : cycle.rows)
          visit_row(row, visit);
        visit_size(cycle.divided_cells);
        for (auto &cell : cycle.divided_cells)
          for (unsigned int &part : cell)
            visit_number(part);
      }
    }

    struct Damaged
    {
    };
  } // namespace

  void Checkpoint::save(const std::string &directory, const MPI_Comm comm) const
  {
    MPI_Barrier(comm);
    if (is_rank_zero(comm))
    {
      std::vector<double> numbers;
      for (const std::uintmax_t size : file_sizes(directory, tables))
        numbers.push_back(size);
      Checkpoint copy = *this;
      visit_record(copy, [&](const double value) { numbers.push_back(value); });
      save_numbers(state_file(directory), numbers);
    }
    MPI_Barrier(comm);
  }

  std::optional<Checkpoint> Checkpoint::resume(const std::string &directory, const MPI_Comm comm)
  {
    const std::optional<std::vector<double>> numbers = load_numbers(state_file(directory));
    Checkpoint record;
    int good = numbers && numbers->size() >= tables.size();
    if (good)
      try
      {
        auto at = numbers->begin() + tables.size();
        visit_record(record,
                     [&](double &value)
                     {
                       if (at == numbers->end())
                         throw Damaged();
                       value = *at++;
                     });
      }
      catch (const Damaged &)
      {
        good = false;
      }
    MPI_Allreduce(MPI_IN_PLACE, &good, 1, MPI_INT, MPI_MIN, comm);
    if (!good)
      return std::nullopt;
    cut_files(directory, tables, {numbers->begin(), numbers->begin() + tables.size()}, comm);
    return record;
  }

  void Checkpoint::remove(const std::string &directory, const MPI_Comm comm)
  {
    MPI_Barrier(comm);
    std::error_code ignored;
    if (is_rank_zero(comm))
      std::filesystem::remove(state_file(directory), ignored);
  }
} // namespace squeal
