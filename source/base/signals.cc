#include <squeal/base/errors.h>
#include <squeal/base/signals.h>

#include <csignal>
#include <cstring>
#include <unistd.h>

namespace squeal
{
  namespace
  {
    volatile std::sig_atomic_t signal_received = 0;

    /// Libraries factorise for minutes without a place where they ask. Only calls that are safe in
    /// a signal's handler.
    extern "C" void end_now(int)
    {
      const char message[] =
          "\nsqueal: ended by a signal in the middle of a step. Results so far are kept; a "
          "refinement, sweep or map goes on when it is started again with the same parameters.\n";
      [[maybe_unused]] const auto written = write(STDERR_FILENO, message, std::strlen(message));
      _exit(exit_other);
    }

    extern "C" void remember(const int signal)
    {
      signal_received = signal;
      // The next one has its usual effect, also if it is another one.
      std::signal(SIGINT, SIG_DFL);
      std::signal(SIGTERM, SIG_DFL);
      alarm(seconds_to_clean_place);
    }
  } // namespace

  void end_cleanly_on_signals()
  {
    struct sigaction action
    {
    };
    action.sa_handler = remember;
    action.sa_flags   = SA_RESTART | int(SA_RESETHAND); // the next signal has its usual effect
    sigemptyset(&action.sa_mask);
    std::signal(SIGALRM, end_now);
    for (const int signal : {SIGINT, SIGTERM})
      sigaction(signal, &action, nullptr);
  }

  void check_interruption()
  {
    if (signal_received == 0)
      return;
    alarm(0);
    throw Interrupted(signal_received == SIGINT ? "SIGINT" : "SIGTERM");
  }
} // namespace squeal
