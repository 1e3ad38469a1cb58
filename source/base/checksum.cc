#include <squeal/base/checksum.h>
#include <squeal/base/text.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <vector>

namespace squeal
{
  Checksum &Checksum::add(const void *data, const std::size_t n_bytes)
  {
    const auto *bytes = static_cast<const unsigned char *>(data);
    for (std::size_t i = 0; i < n_bytes; ++i)
      value_ = (value_ ^ bytes[i]) * 0x100000001b3u;
    return *this;
  }

  std::string Checksum::text() const
  {
    return formatted("%016llx", static_cast<unsigned long long>(value_));
  }

  namespace
  {
    /// Adds at most @p n_bytes from @p first on. Returns how many there were.
    std::uint64_t add_part(const std::string &filename, const std::uint64_t first,
                           const std::uint64_t n_bytes, Checksum &sum)
    {
      std::ifstream in(filename, std::ios::binary);
      if (!in || !in.seekg(std::streamoff(first)))
        throw std::runtime_error("The file " + filename + " cannot be read.");
      std::vector<char> buffer(1 << 16);
      std::uint64_t done = 0;
      while (done < n_bytes)
      {
        in.read(buffer.data(), std::min<std::uint64_t>(buffer.size(), n_bytes - done));
        if (in.gcount() <= 0)
          break;
        sum.add(buffer.data(), in.gcount());
        done += in.gcount();
      }
      return done;
    }
  } // namespace

  FileMark mark_of(const std::string &filename, const FileMark &before)
  {
    std::error_code error;
    const std::uint64_t size = std::filesystem::file_size(filename, error);
    if (error)
      return {};
    const FileMark start = before.n_bytes <= size ? before : FileMark();
    Checksum sum(start.checksum);
    const std::uint64_t n = add_part(filename, start.n_bytes, size - start.n_bytes, sum);
    return {start.n_bytes + n, sum.value()};
  }

  bool begins_with(const std::string &filename, const FileMark &mark)
  {
    if (mark.n_bytes == 0)
      return true;
    if (!std::filesystem::is_regular_file(filename))
      return false;
    Checksum sum;
    return add_part(filename, 0, mark.n_bytes, sum) == mark.n_bytes && sum.value() == mark.checksum;
  }
} // namespace squeal
