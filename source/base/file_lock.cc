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
    descriptor =
        open(filename.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW, 0666);
    struct stat own
    {
    }, named{};
    if (descriptor < 0 || fstat(descriptor, &own) != 0)
      fail(errno);
    if (!S_ISREG(own.st_mode))
      fail(EEXIST);

    std::array<char, 400> holder{};
    if (pread(descriptor, holder.data(), holder.size() - 1, 0) < 0)
      fail(errno);
    long process = 0;
    std::array<char, 300> host{};
    const bool known =
        std::sscanf(holder.data(), "process %ld on %299s", &process, host.data()) == 2;
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
    const std::string text = formatted("process %ld on %s\n", long(getpid()), host_name().c_str());
    if (ftruncate(descriptor, 0) != 0 ||
        pwrite(descriptor, text.data(), text.size(), 0) != ssize_t(text.size()))
      fail(errno == 0 ? ENOSPC : errno);
    return true;
  }

  FileLock::~FileLock()
  {
    // While it is held: who opened it before sees that it is gone, and makes a new one.
    unlink(filename.c_str());
    close(descriptor);
  }
} // namespace squeal
