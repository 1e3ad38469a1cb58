#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace squeal
{
  /// A number of 64 bits that hardly two different texts share (FNV-1a). It finds accidents, not
  /// forgeries.
  class Checksum
  {
  public:
    Checksum() = default;
    /// Goes on from the value of an earlier one.
    explicit Checksum(const std::uint64_t value) : value_(value) {}

    Checksum &add(const void *data, std::size_t n_bytes);
    Checksum &add(const std::string &text)
    {
      return add(text.data(), text.size());
    }
    std::uint64_t value() const
    {
      return value_;
    }
    /// 16 hexadecimal digits.
    std::string text() const;

  private:
    std::uint64_t value_ = 0xcbf29ce484222325u;
  };

  /// The beginning of a file: its length in bytes and the checksum of it.
  struct FileMark
  {
    std::uint64_t n_bytes  = 0;
    std::uint64_t checksum = Checksum().value();
  };

  /// The mark of a whole file; of no bytes if it does not exist. If the file begins with what @p
  /// before marks, only the rest is read. Throws std::runtime_error if it cannot be read.
  FileMark mark_of(const std::string &filename, const FileMark &before = {});

  /// Whether the file still begins with what was marked.
  bool begins_with(const std::string &filename, const FileMark &mark);
} // namespace squeal
