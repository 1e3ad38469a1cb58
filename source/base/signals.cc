#include <squeal/base/errors.h>
#include <squeal/base/signals.h>

#include <csignal>

namespace squeal
{
  namespace
  {
    volatile std::sig_atomic_t signal_received = 0;

    extern "C" void remember(const int signal)
    {
      signal_received = signal;
      // The next one has its usual effect, also if it is another one.
      std::signal(SIGINT, SIG_DFL);
      std::signal(SIGTERM, SIG_DFL);
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
    for (const int signal : {SIGINT, SIGTERM})
      sigaction(signal, &action, nullptr);
  }

  void check_interruption()
  {
    if (signal_received != 0)
      throw Interrupted(signal_received == SIGINT ? "SIGINT" : "SIGTERM");
  }
} // namespace squeal
