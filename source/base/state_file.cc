#include <squeal/base/files.h>
#include <squeal/base/log.h>
#include <squeal/base/state_file.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <limits>
#include <ostream>
#include <stdexcept>

namespace squeal
{
  namespace
  {
    const std::string magic = "squeal state 3\n";

    struct Content
    {
      std::vector<std::string> tables;
      std::vector<FileMark> marks;
      std::vector<double> numbers;
    };

    void put(std::string &text, const std::uint64_t value)
    {
      text.append(reinterpret_cast<const char *>(&value), sizeof(value));
    }

    std::string encode(const Content &content)
    {
      std::string text = magic;
      put(text, content.tables.size());
      for (unsigned int k = 0; k < content.tables.size(); ++k)
      {
        put(text, content.tables[k].size());
        text += content.tables[k];
        put(text, content.marks[k].n_bytes);
        put(text, content.marks[k].checksum);
      }
      put(text, content.numbers.size());
      text.append(reinterpret_cast<const char *>(content.numbers.data()),
                  content.numbers.size() * sizeof(double));
      put(text, Checksum().add(text).value());
      return text;
    }

    /// Throws std::runtime_error if the text is not what encode() made. Every size in it is
    /// compared with what there is.
    Content decode(const std::string &text)
    {
      if (text.compare(0, magic.size(), magic) != 0)
        throw std::runtime_error("is not a state of this version of squeal");
      std::uint64_t sum = 0;
      if (text.size() < magic.size() + sizeof(sum))
        throw std::runtime_error("is damaged");
      const std::size_t end = text.size() - sizeof(sum);
      std::memcpy(&sum, text.data() + end, sizeof(sum));
      if (Checksum().add(text.data(), end).value() != sum)
        throw std::runtime_error("is damaged");

      std::size_t at  = magic.size();
      const auto take = [&](void *target, const std::uint64_t n_bytes)
      {
        if (n_bytes > end - at)
          throw std::runtime_error("is damaged");
        std::memcpy(target, text.data() + at, n_bytes);
        at += n_bytes;
      };
      const auto take_size = [&](const std::size_t n_bytes_each)
      {
        std::uint64_t n = 0;
        take(&n, sizeof(n));
        if (n > (end - at) / n_bytes_each)
          throw std::runtime_error("is damaged");
        return n;
      };
      Content content;
      const std::uint64_t n_tables = take_size(3 * sizeof(std::uint64_t));
      for (std::uint64_t k = 0; k < n_tables; ++k)
      {
        std::string name(take_size(1), '\0');
        take(name.data(), name.size());
        FileMark mark;
        take(&mark.n_bytes, sizeof(mark.n_bytes));
        take(&mark.checksum, sizeof(mark.checksum));
        content.tables.push_back(name);
        content.marks.push_back(mark);
      }
      content.numbers.resize(take_size(sizeof(double)));
      take(content.numbers.data(), content.numbers.size() * sizeof(double));
      return content;
    }

    /// Throws std::runtime_error, also if a table is not what it was.
    Content read(const std::string &directory, const std::string &filename)
    {
      Content content = decode(
          read_whole_file(directory + "/" + filename, std::numeric_limits<std::size_t>::max() / 2));
      for (unsigned int k = 0; k < content.tables.size(); ++k)
        if (!begins_with(directory + "/" + content.tables[k], content.marks[k]))
          throw std::runtime_error("knows the table " + content.tables[k] +
                                   " as it was: somebody changed it");
      return content;
    }
  } // namespace

  StateFile::StateFile(const std::string &directory, const std::string &name,
                       const std::vector<std::string> &tables)
      : directory(directory), filename(name + ".state"), tables(tables), marks(tables.size())
  {
  }

  void StateFile::save(const std::vector<double> &numbers, const MPI_Comm comm)
  {
    MPI_Barrier(comm);
    if (is_rank_zero(comm))
    {
      for (unsigned int k = 0; k < tables.size(); ++k)
      {
        const std::string table = directory + "/" + tables[k];
        marks[k]                = mark_of(table, marks[k]);
        sync_to_disk(table);
      }
      const std::string text = encode({tables, marks, numbers});
      write_file(directory + "/" + filename,
                 [&](std::ostream &out) { out.write(text.data(), text.size()); });
    }
    MPI_Barrier(comm);
  }

  std::optional<std::vector<double>> StateFile::resume(const MPI_Comm comm)
  {
    int good = 0;
    Content content;
    if (is_rank_zero(comm) && std::filesystem::exists(directory + "/" + filename))
      try
      {
        content = read(directory, filename);
        good    = content.tables == tables;
        for (unsigned int k = 0; good != 0 && k < tables.size(); ++k)
        {
          const std::string table = directory + "/" + tables[k];
          marks[k]                = content.marks[k];
          if (marks[k].n_bytes == 0) // it did not exist
            std::filesystem::remove(table);
          else
            std::filesystem::resize_file(table, marks[k].n_bytes);
        }
      }
      catch (const std::exception &)
      {
        good = 0;
      }
    MPI_Bcast(&good, 1, MPI_INT, 0, comm);
    if (good == 0)
      return std::nullopt;
    unsigned long long size = content.numbers.size();
    MPI_Bcast(&size, 1, MPI_UNSIGNED_LONG_LONG, 0, comm);
    content.numbers.resize(size);
    constexpr unsigned long long most_at_once = 1 << 24;
    for (unsigned long long first = 0; first < size; first += most_at_once)
      MPI_Bcast(content.numbers.data() + first, int(std::min(most_at_once, size - first)),
                MPI_DOUBLE, 0, comm);
    return content.numbers;
  }

  void StateFile::remove(const MPI_Comm comm) const
  {
    MPI_Barrier(comm);
    std::error_code ignored;
    if (is_rank_zero(comm))
      std::filesystem::remove(directory + "/" + filename, ignored);
  }

  std::string StateFile::objection(const std::string &directory, const std::string &filename)
  {
    try
    {
      read(directory, filename);
      return "";
    }
    catch (const std::exception &error)
    {
      return filename + " " + error.what() + ".";
    }
  }
} // namespace squeal
