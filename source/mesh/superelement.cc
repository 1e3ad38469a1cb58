#include <squeal/mesh/superelement.h>

#include <algorithm>

namespace squeal
{
  unsigned int Superelement::n_held() const
  {
    return std::count(is_held.begin(), is_held.end(), true);
  }
} // namespace squeal
