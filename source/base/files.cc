#include <squeal/base/files.h>
#include <squeal/base/log.h>

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace squeal
{
  namespace
  {
    [[noreturn]] void fail(const std::string &filename, const int reason,
                           const std::string &what = "written")
    {
      throw std::runtime_error("The file " + filename + " cannot be " + what + ": " +
                               (reason != 0 ? std::strerror(reason) : "unknown reason") +
                               (what == "written" ? ". Results so far are kept." : "."));
    }

    /// Closes a file when it goes out of scope.
    struct Descriptor
    {
      explicit Descriptor(const int number) : number(number) {}
      ~Descriptor()
      {
        if (number >= 0)
          close(number);
      }
      Descriptor(const Descriptor &)            = delete;
      Descriptor &operator=(const Descriptor &) = delete;
      const int number;
    };

    FileObserver &observer()
    {
      static FileObserver instance;
      return instance;
    }

    std::string directory_of(const std::string &filename)
    {
      const std::string parent = std::filesystem::path(filename).parent_path().string();
      return parent.empty() ? "." : parent;
    }
  } // namespace

  void set_file_observer(FileObserver other)
  {
    observer() = std::move(other);
  }

  void announce_files(const std::vector<std::string> &filenames)
  {
    if (observer())
      observer()(filenames);
  }

  void make_directory(const std::string &name)
  {
    std::error_code code;
    std::filesystem::create_directory(name, code);
    if (code)
      throw std::runtime_error("The directory " + name + " cannot be made: " + code.message() +
                               ". Results so far are kept.");
  }

  void sync_to_disk(const std::string &filename)
  {
    const Descriptor file(open(filename.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (file.number < 0 && errno == ENOENT)
      return;
    // Some file systems cannot sync a directory: EINVAL.
    if (file.number < 0 || (fsync(file.number) != 0 && errno != EINVAL))
      fail(filename, errno);
  }

  void write_file(const std::string &filename, const std::function<void(std::ostream &)> &write)
  {
    announce_files({filename});
    const std::string unfinished = filename + ".part";
    // A link would be followed, out of the directory.
    if (std::filesystem::is_symlink(std::filesystem::symlink_status(unfinished)))
      std::filesystem::remove(unfinished);
    const auto give_up = [&](const int reason)
    {
      std::error_code ignored;
      std::filesystem::remove(unfinished, ignored);
      fail(filename, reason);
    };
    errno = 0;
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
        give_up(reason);
      }
    }
    try
    {
      sync_to_disk(unfinished);
    }
    catch (const std::runtime_error &)
    {
      give_up(errno);
    }
    if (std::rename(unfinished.c_str(), filename.c_str()) != 0)
      give_up(errno);
    sync_to_disk(directory_of(filename));
  }

  void append_to_file(const std::string &filename, const std::string &text)
  {
    announce_files({filename});
    const Descriptor file(open(filename.c_str(),
                               O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW,
                               0666));
    struct stat before
    {
    };
    if (file.number < 0 || fstat(file.number, &before) != 0)
      fail(filename, errno);
    for (std::size_t done = 0; done < text.size();)
    {
      const ssize_t n = ::write(file.number, text.data() + done, text.size() - done);
      if (n < 0 && errno == EINTR)
        continue;
      if (n <= 0)
      {
        const int reason = n == 0 ? ENOSPC : errno;
        // Half a number as the last row would be a wrong one.
        if (ftruncate(file.number, before.st_size) != 0)
          fail(filename, errno);
        fail(filename, reason);
      }
      done += n;
    }
  }

  void write_text(const std::string &filename, const std::string &text, const MPI_Comm comm)
  {
    if (is_rank_zero(comm))
      write_file(filename, [&](std::ostream &out) { out << text; });
  }

  void write_in_pieces(const std::string &filename, const std::function<std::string()> &next_piece,
                       const MPI_Comm comm)
  {
    constexpr int tag = 18;
    if (!is_rank_zero(comm))
    {
      std::string piece;
      do
      {
        piece = next_piece();
        MPI_Send(piece.data(), piece.size(), MPI_CHAR, 0, tag, comm);
      } while (!piece.empty());
      return;
    }
    int n_ranks = 1;
    MPI_Comm_size(comm, &n_ranks);
    const auto receive = [&](const int rank)
    {
      MPI_Status status;
      MPI_Probe(rank, tag, comm, &status);
      int n = 0;
      MPI_Get_count(&status, MPI_CHAR, &n);
      std::string piece(n, ' ');
      MPI_Recv(piece.data(), n, MPI_CHAR, rank, tag, comm, MPI_STATUS_IGNORE);
      return piece;
    };
    // A full disk does not end the loops: who sends a piece waits until it is taken.
    write_file(filename,
               [&](std::ostream &out)
               {
                 for (std::string piece = next_piece(); !piece.empty(); piece = next_piece())
                   out << piece;
                 for (int rank = 1; rank < n_ranks; ++rank)
                   for (std::string piece = receive(rank); !piece.empty(); piece = receive(rank))
                     out << piece;
               });
  }

  std::ifstream open_regular_file(const std::string &filename)
  {
    std::ifstream in;
    std::error_code impossible; // as of a name that is too long
    if (std::filesystem::is_regular_file(filename, impossible))
      in.open(filename);
    // A byte order mark, which editors put in front of UTF-8, is no text.
    std::string first(byte_order_mark.size(), '\0');
    if (in.is_open() && (!in.read(first.data(), first.size()) || first != byte_order_mark))
    {
      in.clear();
      in.seekg(0);
    }
    return in;
  }

  std::string read_whole_file(const std::string &filename, const std::size_t most_bytes)
  {
    const Descriptor file(open(filename.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    struct stat status
    {
    };
    if (file.number < 0 || fstat(file.number, &status) != 0)
      fail(filename, errno, "read");
    if (!S_ISREG(status.st_mode))
      throw std::runtime_error("The file " + filename +
                               " cannot be read: it is not a regular file.");
    if (std::size_t(status.st_size) > most_bytes)
      throw std::runtime_error("The file " + filename + " cannot be read: it has " +
                               std::to_string(status.st_size) + " bytes, allowed are " +
                               std::to_string(most_bytes) + ".");
    std::string text(status.st_size, '\0');
    std::size_t done = 0;
    while (done < text.size())
    {
      const ssize_t n = read(file.number, text.data() + done, text.size() - done);
      if (n < 0 && errno == EINTR)
        continue;
      if (n < 0)
        fail(filename, errno, "read");
      if (n == 0)
        break;
      done += n;
    }
    text.resize(done);
    return text;
  }

  std::string read_whole_file_or_pipe(const std::string &filename, const std::size_t most_bytes)
  {
    const Descriptor file(open(filename.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    struct stat status
    {
    };
    if (file.number < 0 || fstat(file.number, &status) != 0)
      fail(filename, errno, "read");
    if (S_ISREG(status.st_mode))
      return read_whole_file(filename, most_bytes);
    std::string text;
    std::array<char, 1 << 12> buffer;
    // What is written may take its time, but there must be somebody who writes.
    constexpr int patience = 5000, step = 100; // milliseconds
    for (int waited = 0;;)
    {
      const ssize_t n = read(file.number, buffer.data(), buffer.size());
      if (n > 0)
        text.append(buffer.data(), n);
      if (text.size() > most_bytes)
        throw std::runtime_error("The file " + filename + " cannot be read: it has more than " +
                                 std::to_string(most_bytes) + " bytes.");
      if (n < 0 && errno != EINTR && errno != EAGAIN)
        fail(filename, errno, "read");
      if (n == 0 && (!text.empty() || !S_ISFIFO(status.st_mode)))
        return text;
      if (n == 0 && waited >= patience)
        throw std::runtime_error("The file " + filename +
                                 " cannot be read: it is a pipe into which nobody writes.");
      pollfd event{file.number, POLLIN, 0};
      if (n <= 0 && poll(&event, 1, step) == 0 && n == 0)
        waited += step;
      if (n == 0 && (event.revents & POLLHUP) != 0) // who wrote into it has ended
        waited = patience;
    }
  }
} // namespace squeal
