#include <squeal/base/files.h>
#include <squeal/base/log.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace squeal
{
  namespace
  {
    [[noreturn]] void fail(const std::string &filename)
    {
      const std::string reason = errno != 0 ? std::strerror(errno) : "unknown reason";
      throw std::runtime_error("The file " + filename + " cannot be written: " + reason +
                               ". Results so far are kept.");
    }
  } // namespace

  void write_file(const std::string &filename, const std::function<void(std::ostream &)> &write)
  {
    const std::string unfinished = filename + ".part";
    errno                        = 0;
    {
      std::ofstream out(unfinished, std::ios::binary);
      try
      {
        if (out)
          write(out);
      }
      catch (...) // of a library that noticed the stream's failure
      {
        if (out)
          throw;
      }
      if (!out.flush())
      {
        const int reason = errno;
        out.close();
        std::error_code ignored;
        std::filesystem::remove(unfinished, ignored);
        errno = reason;
        fail(filename);
      }
    }
    std::error_code error;
    std::filesystem::rename(unfinished, filename, error);
    if (error)
    {
      errno = error.value();
      fail(filename);
    }
  }

  void append_to_file(const std::string &filename, const std::string &text)
  {
    errno = 0;
    std::ofstream out(filename, std::ios::app | std::ios::binary);
    out << text;
    if (!out.flush())
      fail(filename);
  }

  void write_text(const std::string &filename, const std::string &text, const MPI_Comm comm)
  {
    if (is_rank_zero(comm))
      write_file(filename, [&](std::ostream &out) { out << text; });
  }

  void save_numbers(const std::string &filename, const std::vector<double> &numbers)
  {
    write_file(filename,
               [&](std::ostream &out)
               {
                 const std::uint64_t size = numbers.size();
                 out.write(reinterpret_cast<const char *>(&size), sizeof(size));
                 out.write(reinterpret_cast<const char *>(numbers.data()), size * sizeof(double));
               });
  }

  std::optional<std::vector<double>> load_numbers(const std::string &filename)
  {
    std::ifstream in(filename, std::ios::binary);
    std::uint64_t size = 0;
    if (!in || !in.read(reinterpret_cast<char *>(&size), sizeof(size)) || size > (1ull << 32))
      return std::nullopt;
    std::vector<double> numbers(size);
    if (!in.read(reinterpret_cast<char *>(numbers.data()), size * sizeof(double)))
      return std::nullopt;
    return numbers;
  }

  std::vector<std::uintmax_t> file_sizes(const std::string &directory,
                                         const std::vector<std::string> &names)
  {
    std::vector<std::uintmax_t> sizes;
    for (const std::string &name : names)
    {
      const std::string file = directory + "/" + name;
      sizes.push_back(std::filesystem::exists(file) ? std::filesystem::file_size(file) : 0);
    }
    return sizes;
  }

  void cut_files(const std::string &directory, const std::vector<std::string> &names,
                 const std::vector<std::uintmax_t> &sizes, const MPI_Comm comm)
  {
    if (is_rank_zero(comm))
      for (unsigned int k = 0; k < names.size(); ++k)
      {
        const std::string file = directory + "/" + names[k];
        if (!std::filesystem::exists(file))
          continue;
        if (sizes[k] == 0) // it did not exist
          std::filesystem::remove(file);
        else
          std::filesystem::resize_file(file, sizes[k]);
      }
    MPI_Barrier(comm);
  }
} // namespace squeal
