// What mpirun starts in place of a program whose libraries fork_server.cc has loaded: asks for a
// process with this one's arguments (the program's first), directory, environment and files, hands
// signals on to it, and ends as it ends.

#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <initializer_list>

extern char **environ;

namespace
{
  volatile sig_atomic_t process = 0;

  void hand_on(const int signal)
  {
    if (process > 0)
      kill(process, signal);
  }

  /// The request that fork_server.cc describes.
  bool ask(const int socket, const int n_arguments, char **arguments)
  {
    constexpr std::size_t capacity = 1 << 20;
    static char text[capacity];
    std::uint32_t size = 0;
    const auto add     = [&](const char *field)
    {
      const std::size_t length = std::strlen(field) + 1;
      if (size + length > capacity)
        _exit(127);
      std::memcpy(text + size, field, length);
      size += std::uint32_t(length);
    };
    char directory[4096], number[2] = {char('0' + n_arguments), 0};
    if (n_arguments > 9 || !getcwd(directory, sizeof(directory)))
      return false;
    add(directory);
    add(number);
    for (int a = 0; a < n_arguments; ++a)
      add(arguments[a]);
    for (char **variable = environ; *variable; ++variable)
      add(*variable);

    const int files[3]                                       = {0, 1, 2};
    alignas(cmsghdr) char control[CMSG_SPACE(sizeof(files))] = {};
    iovec part{&size, sizeof(size)};
    msghdr message{};
    message.msg_iov        = &part;
    message.msg_iovlen     = 1;
    message.msg_control    = control;
    message.msg_controllen = sizeof(control);
    cmsghdr *header        = CMSG_FIRSTHDR(&message);
    header->cmsg_level     = SOL_SOCKET;
    header->cmsg_type      = SCM_RIGHTS;
    header->cmsg_len       = CMSG_LEN(sizeof(files));
    std::memcpy(CMSG_DATA(header), files, sizeof(files));
    if (sendmsg(socket, &message, 0) != sizeof(size))
      return false;
    for (std::uint32_t sent = 0; sent < size;)
    {
      const ssize_t n = write(socket, text + sent, size - sent);
      if (n <= 0)
        return false;
      sent += std::uint32_t(n);
    }
    return true;
  }

  /// Interrupted by signals that are handed on, it goes on.
  bool read_all(const int socket, void *data, std::size_t size)
  {
    for (char *place = static_cast<char *>(data); size > 0;)
    {
      const ssize_t n = read(socket, place, size);
      if (n <= 0)
        return false;
      place += n;
      size -= std::size_t(n);
    }
    return true;
  }
} // namespace

int main(int n_arguments, char **arguments)
{
  const char *address = std::getenv("FORK_SERVER_ADDRESS");
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  std::strncpy(name.sun_path, address ? address : "", sizeof(name.sun_path) - 1);
  const int server    = socket(AF_UNIX, SOCK_STREAM, 0);
  std::int32_t number = 0;
  if (connect(server, reinterpret_cast<const sockaddr *>(&name), sizeof(name)) != 0 ||
      !ask(server, n_arguments - 1, arguments + 1) || !read_all(server, &number, sizeof(number)))
    return 127;
  process = number;
  for (const int signal : {SIGTERM, SIGINT, SIGHUP, SIGUSR1, SIGUSR2})
  {
    struct sigaction action = {};
    action.sa_handler       = hand_on;
    action.sa_flags         = SA_RESTART;
    sigaction(signal, &action, nullptr);
  }
  struct
  {
    std::int32_t status, unused;
    double seconds;
  } answer;
  if (!read_all(server, &answer, sizeof(answer)))
    return 127;
  if (WIFSIGNALED(answer.status))
  {
    signal(WTERMSIG(answer.status), SIG_DFL);
    raise(WTERMSIG(answer.status));
  }
  return WEXITSTATUS(answer.status);
}
