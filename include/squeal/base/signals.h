#pragma once

namespace squeal
{
  /// How long a signal waits for a clean place.
  constexpr unsigned int seconds_to_clean_place = 5;

  /// SIGINT and SIGTERM end the run at the next place where that is clean, or where it is after
  /// some seconds; a second one ends it at once.
  void end_cleanly_on_signals();

  /// Throws Interrupted if a signal has come. Long loops call this, once in a second or so.
  void check_interruption();
} // namespace squeal
