#pragma once

#include <stdexcept>
#include <string>

namespace squeal
{
  /// Somebody else holds the lock; the message says who: process and host.
  struct Locked : std::runtime_error
  {
    using std::runtime_error::runtime_error;
  };

  /// Holds a file that only one process of all that share the file system can hold. The system
  /// gives it free when the process ends, however it ends; in the file stand process and host, for
  /// messages. Where the file system has no locks, a process of that number that lives on the same
  /// host counts as the holder.
  class FileLock
  {
  public:
    /// Throws Locked, or std::runtime_error if the file cannot be made, or if there is one that
    /// no lock has left: that is not touched.
    explicit FileLock(const std::string &filename);
    /// Removes the file. One that was there before, and empty, is left so.
    ~FileLock();
    FileLock(const FileLock &)            = delete;
    FileLock &operator=(const FileLock &) = delete;

  private:
    /// False if the file that was opened has been removed meanwhile, by the holder before.
    bool take();
    void release();

    const std::string filename;
    int descriptor = -1;
    bool is_own    = false; ///< made by a lock: this one, or one that was killed
  };
} // namespace squeal
