#pragma once

#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <optional>
#include <type_traits>
#include <vector>

namespace squeal
{
  /// Collects the numbers of a record in one order, or fills a record with them. One function
  /// describes both ways, beside the type of the record:
  ///     void serialize(Archive &archive, Record &record) { archive(record.a, record.b); }
  /// Handed over are real and complex numbers, counts, enumerations that have names, and arrays,
  /// lists and optional values of what is handed over. A StateFile keeps the numbers.
  class Archive
  {
  public:
    /// Thrown if the numbers are not those of such a record.
    struct Damaged
    {
    };

    /// Collects.
    Archive() = default;
    /// Fills records with these numbers.
    explicit Archive(std::vector<double> numbers) : list(std::move(numbers)), fills(true) {}

    template <typename... Parts>
    void operator()(Parts &...parts)
    {
      (hand_over(parts), ...);
    }

    /// Whether every number has been used.
    bool is_used_up() const
    {
      return next == list.size();
    }
    const std::vector<double> &numbers() const
    {
      return list;
    }

  private:
    void hand_over(double &value)
    {
      if (!fills)
        list.push_back(value);
      else if (is_used_up())
        throw Damaged();
      else
        value = list[next++];
    }
    void hand_over(std::complex<double> &z)
    {
      double re = z.real(), im = z.imag();
      (*this)(re, im);
      z = {re, im};
    }
    template <typename T>
    void hand_over(T &value)
    {
      if constexpr (std::is_integral_v<T>)
        value = natural(value, std::numeric_limits<T>::max());
      else if constexpr (std::is_enum_v<T>)
        value = T(int(natural(double(int(value)), double(names_of(value).size()) - 1)));
      else
        serialize(*this, value);
    }
    template <typename T, std::size_t n>
    void hand_over(std::array<T, n> &parts)
    {
      for (T &part : parts)
        hand_over(part);
    }
    template <typename T>
    void hand_over(std::vector<T> &parts)
    {
      // Each part has a number at least.
      parts.resize(natural(double(parts.size()), double(list.size() - next)));
      for (T &part : parts)
        hand_over(part);
    }
    template <typename T>
    void hand_over(std::optional<T> &value)
    {
      bool is_known = value.has_value();
      T inner       = value.value_or(T());
      (*this)(is_known, inner);
      value = is_known ? std::optional<T>(inner) : std::nullopt;
    }
    /// A count, which must not exceed @p most when it is filled in.
    double natural(double value, const double most)
    {
      hand_over(value);
      if (fills && !(value >= 0 && value <= most && value == std::floor(value)))
        throw Damaged();
      return value;
    }

    std::vector<double> list;
    bool fills       = false;
    std::size_t next = 0; ///< to be filled in
  };

  /// The numbers of a record.
  template <typename Record>
  std::vector<double> numbers_of(Record record)
  {
    Archive archive;
    archive(record);
    return archive.numbers();
  }

  /// The record of these numbers; nothing if they are not those of one.
  template <typename Record>
  std::optional<Record> record_of(const std::vector<double> &numbers)
  {
    try
    {
      Archive archive(numbers);
      Record record;
      archive(record);
      if (archive.is_used_up())
        return record;
    }
    catch (const Archive::Damaged &)
    {
    }
    return std::nullopt;
  }
} // namespace squeal
