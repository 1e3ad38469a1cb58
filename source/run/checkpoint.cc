#include <squeal/base/state_file.h>
#include <squeal/run/checkpoint.h>

#include <cmath>
#include <limits>

namespace squeal
{
  namespace
  {
    const std::vector<std::string> tables = {"modes.csv", "cycles.csv", "contributions.csv",
                                             "sensitivities.csv", "static.csv"};

    StateFile state_file(const std::string &directory)
    {
      return {directory, "refinement", tables};
    }

    struct Damaged
    {
    };

    /// Takes the numbers of a record, in one order, to a list.
    struct Writer
    {
      std::vector<double> &numbers;

      void operator()(const double value) const
      {
        numbers.push_back(value);
      }
      double most() const
      {
        return std::numeric_limits<double>::infinity();
      }
    };

    /// Fills in the numbers of a record from a list. Throws Damaged at its end.
    struct Reader
    {
      const std::vector<double> &numbers;
      mutable std::size_t at = 0;

      void operator()(double &value) const
      {
        if (at == numbers.size())
          throw Damaged();
        value = numbers[at++];
      }
      /// The length of no list in the record can be greater than that.
      double most() const
      {
        return numbers.size() - at;
      }
    };

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
      // Counts and names of cells
      const auto visit_natural = [&](auto &value)
      {
        using Natural     = std::decay_t<decltype(value)>;
        double number     = value;
        const double most = std::numeric_limits<Natural>::max();
        visit(number);
        if (!(number >= 0 && number <= most && number == std::floor(number)))
          throw Damaged();
        value = number;
      };
      const auto visit_size = [&](auto &list)
      {
        double size = list.size();
        visit(size);
        if (!(size >= 0 && size <= visit.most() + list.size() && size == std::floor(size)))
          throw Damaged();
        list.resize(size);
      };
      const auto visit_cells = [&](auto &cells)
      {
        visit_size(cells);
        for (auto &cell : cells)
          for (unsigned int &part : cell)
            visit_natural(part);
      };
      visit_natural(record.finished);
      visit_size(record.divided_at_edge);
      for (auto &cells : record.divided_at_edge)
        visit_cells(cells);
      visit_size(record.zone.interfaces);
      for (ContactZone::Interface &interface : record.zone.interfaces)
        for (ContactZone::Points *const points : {&interface.closed, &interface.open})
        {
          visit_size(*points);
          for (std::array<double, 3> &point : *points)
            for (double &x : point)
              visit_number(x);
        }
      visit_size(record.cycles);
      for (Checkpoint::Cycle &cycle : record.cycles)
      {
        visit_natural(cycle.n_unknowns);
        visit_number(cycle.seconds);
        visit_number(cycle.memory_gib);
        visit_size(cycle.rows);
        for (ModeRow &row : cycle.rows)
          visit_row(row, visit);
        visit_cells(cycle.divided_cells);
      }
    }
  } // namespace

  void Checkpoint::save(const std::string &directory, const MPI_Comm comm) const
  {
    std::vector<double> numbers;
    Checkpoint copy = *this;
    visit_record(copy, Writer{numbers});
    state_file(directory).save(numbers, comm);
  }

  std::optional<Checkpoint> Checkpoint::resume(const std::string &directory, const MPI_Comm comm)
  {
    const std::optional<std::vector<double>> numbers = state_file(directory).resume(comm);
    if (!numbers)
      return std::nullopt;
    Checkpoint record;
    const Reader reader{*numbers};
    try
    {
      visit_record(record, reader);
    }
    catch (const Damaged &)
    {
      return std::nullopt;
    }
    return reader.most() == 0 ? std::optional<Checkpoint>(record) : std::nullopt;
  }

  void Checkpoint::remove(const std::string &directory, const MPI_Comm comm)
  {
    state_file(directory).remove(comm);
  }
} // namespace squeal
