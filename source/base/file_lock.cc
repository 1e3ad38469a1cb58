#include <squeal/base/file_lock.h>
#include <squeal/base/text.h>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>

namespace squeal
{
  namespace
  {
    std::string host_name()
    {
      std::array<char, 256> name{};
      return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "unknown";
    }

    /// What stands in the file of a lock.
    std::string text_of_holder(const long process, const std::string &host)
    {
      return formatted("process %ld on %s\n", process, host.c_str());
    }
  } // namespace

  FileLock::FileLock(const std::string &filename) : filename(filename)
  {
    while (!take())
      close(descriptor);
  }

  bool FileLock::take()
  {
    const auto fail = [&](const int reason)
    {
      if (descriptor >= 0)
        close(descriptor);
      throw std::runtime_error("The file " + filename +
                               " cannot be written: " + std::strerror(reason) + ".");
    };
    constexpr int flags = O_RDWR | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW;
    descriptor          = open(filename.c_str(), flags | O_CREAT | O_EXCL, 0666);
    is_own              = descriptor >= 0;
    if (!is_own && errno == EEXIST)
      descriptor = open(filename.c_str(), flags);
    if (descriptor < 0 && errno == ENOENT) // its holder has removed it meanwhile
      return false;
    struct stat own
    {
    }, named{};
    if (descriptor < 0 || fstat(descriptor, &own) != 0)
      fail(errno);
    if (!S_ISREG(own.st_mode))
      fail(EEXIST);

    std::array<char, 400> holder{};
    const ssize_t n_read = pread(descriptor, holder.data(), holder.size() - 1, 0);
    if (n_read < 0)
      fail(errno);
    long process = 0;
    std::array<char, 300> host{};
    const bool known =
        std::sscanf(holder.data(), "process %ld on %299s", &process, host.data()) == 2 &&
        std::string(holder.data(), n_read) == text_of_holder(process, host.data());
    if (n_read > 0 && !known)
    {
      close(descriptor);
      throw std::runtime_error("there is a file " + filename +
                               ", which no run of squeal wrote. It is not touched: move it, or "
                               "name another directory.");
    }
    is_own    = is_own || known;
    bool held = flock(descriptor, LOCK_EX | LOCK_NB) != 0;
    if (held && errno != EWOULDBLOCK && errno != EINTR) // no locks here
      held = known && host_name() == host.data() && process > 0 && kill(process, 0) == 0;
    if (held)
    {
      close(descriptor);
      throw Locked(known ? formatted("process %ld on %s", process, host.data())
                         : "another process");
    }
    if (stat(filename.c_str(), &named) != 0 || named.st_ino != own.st_ino ||
        named.st_dev != own.st_dev)
      return false;
    const std::string text = text_of_holder(getpid(), host_name());
    errno                  = 0;
    if (ftruncate(descriptor, 0) != 0 ||
        pwrite(descriptor, text.data(), text.size(), 0) != ssize_t(text.size()))
    {
      const int reason = errno == 0 ? ENOSPC : errno;
      release(); // half a line would be a foreign file
      descriptor = -1;
      fail(reason);
    }
    return true;
  }

  FileLock::~FileLock()
  {
    release();
  }

  void FileLock::release()
  {
    // While it is held: who opened it before sees that it is gone, and makes a new one. An empty
    // file that was there before may be somebody's.
    if (is_own)
      unlink(filename.c_str());
    else if (ftruncate(descriptor, 0) != 0)
    {
      // It keeps a line that says that it was squeal's.
    }
    close(descriptor);
  }
} // namespace squeal
