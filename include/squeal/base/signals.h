#pragma once

namespace squeal
{
  /// SIGINT and SIGTERM end the run at the next place where that is clean; a second one ends it at
  /// once.
  void end_cleanly_on_signals();

  /// Throws Interrupted if a signal has come. Long loops call this, once in a second or so.
  void check_interruption();
} // namespace squeal
