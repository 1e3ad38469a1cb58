// A preloaded library that lets tests start a program a hundred times without loading its libraries
// a hundred times.
//
// What squeal links against are two hundred shared libraries with 330 000 symbols to resolve: three
// quarters of the processor time of a run of a few cells. A program that is started with LD_PRELOAD
// = this library and FORK_SERVER = the number of a socket stops before main(), its libraries loaded
// and their constructors run. For every request it forks a process, which takes the request's
// directory, arguments, environment, standard input, output and error, and enters main() as if it
// had just been started. The other side is tests/lib/squeal_testing.py.
//
// Request: the fields, each with a zero at its end: directory, number of arguments, arguments,
// environment; with three file descriptors. Answer: the process's number; when it has ended its
// status (wait4) and its processor seconds.
//
// Ranks: mpirun starts fork_client.cc in place of the program. Each client makes its request at the
// socket of the address FORK_SERVER_ADDRESS, and is for mpirun what the program would be. Its
// process ends with it. What these processes took is written to FORK_SERVER_ADDRESS.seconds.
//
// With KILL_AT = CALL:NUMBER in a request's environment the process is killed (SIGKILL) where it
// would make that call, rename, unlink, ftruncate or fsync, for the NUMBER-th time. With
// TRACE = FILE lines "CALL NAME" are written there: of a rename the new name.

#include <dlfcn.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
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

  /// Fields of a request, which stay in `text`, and its files.
  struct Request
  {
    std::vector<char> text;
    int files[3];

    /// False if there is none.
    bool receive(const int socket)
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

    void close_files() const
    {
      for (const int file : files)
        close(file);
    }

    /// For the process that is to enter main(): takes files and directory. Its arguments and
    /// environment one behind the other, as the system hands them over, and the number of
    /// arguments.
    std::pair<int, char **> take() const
    {
      for (int number = 0; number < 3; ++number)
        dup2(files[number], number);
      for (const int file : files)
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
      environ = fields.data() + n_arguments + 3;
      return {n_arguments, fields.data() + 2};
    }
  };

  double seconds(const timeval &time)
  {
    return double(time.tv_sec) + 1e-6 * double(time.tv_usec);
  }

  Answer answer(const int status, const rusage &usage)
  {
    return {status, 0, seconds(usage.ru_utime) + seconds(usage.ru_stime)};
  }

  int listening_socket(const char *address)
  {
    if (!address)
      return -1;
    sockaddr_un name{};
    name.sun_family = AF_UNIX;
    std::strncpy(name.sun_path, address, sizeof(name.sun_path) - 1);
    const int result = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (bind(result, reinterpret_cast<const sockaddr *>(&name), sizeof(name)) != 0 ||
        listen(result, 64) != 0)
      _exit(127);
    return result;
  }

  /// Serves one rank; where that is gone before its process has ended, it ends it. Returns in the
  /// process.
  std::pair<int, char **> serve_rank(const int socket, const std::string &seconds_file)
  {
    Request request;
    if (!request.receive(socket))
      _exit(127);
    const pid_t child = fork();
    if (child == 0)
    {
      close(socket);
      return request.take();
    }
    request.close_files();
    const std::int32_t number = child;
    if (write(socket, &number, sizeof(number)) != sizeof(number))
      kill(child, SIGKILL);
    int status = 0;
    rusage usage{};
    for (pollfd client{socket, POLLIN, 0}; wait4(child, &status, WNOHANG, &usage) == 0;)
      if (poll(&client, 1, 5) > 0)
      {
        kill(child, SIGKILL);
        client.fd = -1;
      }
    const Answer result = answer(status, usage);
    // Short enough to be written whole.
    char line[64];
    const int length = std::snprintf(line, sizeof(line), "%.3f\n", result.seconds);
    const int file   = open(seconds_file.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
    const bool told  = write(file, line, std::size_t(length)) == length;
    const bool sent  = write(socket, &result, sizeof(result)) == sizeof(result);
    _exit(told && sent ? 0 : 127);
  }

  /// Serves until the other side closes the socket. Returns in the processes that it forks only,
  /// what Request::take() gives.
  std::pair<int, char **> serve(const int socket)
  {
    const char *address            = std::getenv("FORK_SERVER_ADDRESS");
    const int ranks                = listening_socket(address);
    const std::string seconds_file = address ? std::string(address) + ".seconds" : "";
    pollfd sockets[2]              = {{socket, POLLIN, 0}, {ranks, POLLIN, 0}};
    while (poll(sockets, 2, -1) > 0)
    {
      while (waitpid(-1, nullptr, WNOHANG) > 0)
        ;
      if (sockets[1].revents)
      {
        const int rank = accept(ranks, nullptr, nullptr);
        if (rank >= 0 && fork() == 0)
        {
          close(socket);
          close(ranks);
          return serve_rank(rank, seconds_file);
        }
        close(rank);
      }
      if (!sockets[0].revents)
        continue;
      Request request;
      if (!request.receive(socket))
        break;
      const pid_t child = fork();
      if (child == 0)
      {
        close(socket);
        close(ranks);
        return request.take();
      }
      request.close_files();
      const std::int32_t number = child;
      if (write(socket, &number, sizeof(number)) != sizeof(number))
        break;
      int status = 0;
      rusage usage{};
      if (child > 0)
        while (wait4(child, &status, 0, &usage) < 0)
          ;
      const Answer result = answer(status, usage);
      if (write(socket, &result, sizeof(result)) != sizeof(result))
        break;
    }
    // So that what they took is this process's.
    while (wait(nullptr) > 0)
      ;
    _exit(0);
  }

  /// What KILL_AT and TRACE ask for, before a call is made.
  void before(const char *call, const std::string &name)
  {
    if (const char *file = std::getenv("TRACE"))
    {
      const std::string line = std::string(call) + " " + name + "\n";
      const int trace        = open(file, O_WRONLY | O_CREAT | O_APPEND, 0600);
      if (write(trace, line.data(), line.size()) != ssize_t(line.size()))
        _exit(127);
      close(trace);
    }
    static int n_calls = 0;
    if (const char *at = std::getenv("KILL_AT"))
    {
      const std::size_t length = std::strlen(call);
      if (std::strncmp(at, call, length) == 0 && at[length] == ':' &&
          ++n_calls == std::atoi(at + length + 1))
        kill(getpid(), SIGKILL);
    }
  }

  std::string name_of(const int file)
  {
    char name[4096];
    const std::string link = "/proc/self/fd/" + std::to_string(file);
    const ssize_t length   = readlink(link.c_str(), name, sizeof(name));
    return {name, std::size_t(length < 0 ? 0 : length)};
  }

  template <typename Function>
  Function next(const char *name, Function)
  {
    return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
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

extern "C" int rename(const char *from, const char *to) noexcept
{
  before("rename", to);
  return next("rename", &rename)(from, to);
}

extern "C" int unlink(const char *name) noexcept
{
  before("unlink", name);
  return next("unlink", &unlink)(name);
}

extern "C" int remove(const char *name) noexcept
{
  before("unlink", name);
  return next("remove", &remove)(name);
}

extern "C" int ftruncate(int file, off_t length) noexcept
{
  before("ftruncate", name_of(file));
  return next("ftruncate", &ftruncate)(file, length);
}

extern "C" int fsync(int file)
{
  before("fsync", name_of(file));
  return next("fsync", &fsync)(file);
}
