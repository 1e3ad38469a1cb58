// A preloaded library that lets tests start a program a hundred times without loading its libraries
// a hundred times.
//
// What squeal links against are two hundred shared libraries with 330 000 symbols to resolve: three
// quarters of the processor time of a run of a few cells. A program that is started with LD_PRELOAD
// = this library and FORK_SERVER = the number of a socket stops before main(), its libraries loaded
// and their constructors run. For every request it forks a process, which takes the request's
// directory, arguments, environment, standard output and error, and enters main() as if it had just
// been started. The other side is tests/lib/squeal_testing.py.
//
// Request: the fields, each with a zero at its end: directory, number of arguments, arguments,
// environment; with two file descriptors. Answer: the process's number; when it has ended its
// status (wait4) and its processor seconds.

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <vector>

namespace
{
  using Main  = int (*)(int, char **, char **);
  using Start = int (*)(Main, int, char **, void (*)(), void (*)(), void (*)(), void *);

  struct Answer
  {
    std::int32_t status;
    std::int32_t unused;
    double seconds;
  };

  bool read_all(const int socket, char *data, std::size_t size)
  {
    while (size > 0)
    {
      const ssize_t n = read(socket, data, size);
      if (n <= 0)
        return false;
      data += n;
      size -= std::size_t(n);
    }
    return true;
  }

  /// The fields of the next request, which stay in `text`, and its files. False if there is none.
  bool receive(const int socket, std::vector<char> &text, int (&files)[2])
  {
    std::uint32_t size = 0;
    iovec part{&size, sizeof(size)};
    alignas(cmsghdr) char control[CMSG_SPACE(sizeof(files))];
    msghdr message{};
    message.msg_iov        = &part;
    message.msg_iovlen     = 1;
    message.msg_control    = control;
    message.msg_controllen = sizeof(control);
    if (recvmsg(socket, &message, MSG_WAITALL) != sizeof(size))
      return false;
    const cmsghdr *header = CMSG_FIRSTHDR(&message);
    if (!header || header->cmsg_type != SCM_RIGHTS)
      return false;
    std::memcpy(files, CMSG_DATA(header), sizeof(files));
    text.resize(size);
    return read_all(socket, text.data(), size);
  }

  double seconds(const timeval &time)
  {
    return double(time.tv_sec) + 1e-6 * double(time.tv_usec);
  }

  /// Serves until the other side closes the socket. Returns in the processes that it forks only:
  /// their arguments and environment one behind the other, as the system hands them over, and the
  /// number of arguments.
  std::pair<int, char **> serve(const int socket)
  {
    std::vector<char> text;
    int files[2];
    while (receive(socket, text, files))
    {
      const pid_t child = fork();
      if (child == 0)
      {
        close(socket);
        const int nothing = open("/dev/null", O_RDONLY);
        dup2(nothing, 0);
        dup2(files[0], 1);
        dup2(files[1], 2);
        for (const int file : {nothing, files[0], files[1]})
          if (file > 2)
            close(file);
        auto &fields = *new std::vector<char *>;
        auto &kept   = *new std::vector<char>(text);
        for (char *field = kept.data(); field < kept.data() + kept.size();
             field += std::strlen(field) + 1)
          fields.push_back(field);
        const int n_arguments = std::atoi(fields[1]);
        if (chdir(fields[0]) != 0)
          _exit(127);
        fields.insert(fields.begin() + 2 + n_arguments, nullptr);
        fields.push_back(nullptr);
        return {n_arguments, fields.data() + 2};
      }
      close(files[0]);
      close(files[1]);
      const std::int32_t number = child;
      if (write(socket, &number, sizeof(number)) != sizeof(number))
        break;
      int status = 0;
      rusage usage{};
      if (child > 0)
        while (wait4(child, &status, 0, &usage) < 0)
          ;
      const Answer answer{status, 0, seconds(usage.ru_utime) + seconds(usage.ru_stime)};
      if (write(socket, &answer, sizeof(answer)) != sizeof(answer))
        break;
    }
    _exit(0);
  }
} // namespace

/// glibc calls it from the program's first instruction; it calls main().
extern "C" int __libc_start_main(Main main, int n_arguments, char **arguments, void (*init)(),
                                 void (*fini)(), void (*end_of_loader)(), void *end_of_stack)
{
  const auto start = reinterpret_cast<Start>(dlsym(RTLD_NEXT, "__libc_start_main"));
  if (const char *socket = std::getenv("FORK_SERVER"))
  {
    const auto [n, given] = serve(std::atoi(socket));
    n_arguments           = n;
    arguments             = given;
  }
  return start(main, n_arguments, arguments, init, fini, end_of_loader, end_of_stack);
}
