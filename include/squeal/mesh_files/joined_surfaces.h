#pragma once

#include <squeal/mesh/mortar.h>

#include <numeric>
#include <string>
#include <vector>

namespace squeal
{
  /// Items 0 ... n-1 in groups that are joined one by one (union-find).
  class Groups
  {
  public:
    explicit Groups(const unsigned int n) : parent(n)
    {
      std::iota(parent.begin(), parent.end(), 0u);
    }
    void join(const unsigned int a, const unsigned int b)
    {
      parent[of(a)] = of(b);
    }
    /// The item that stands for the group of an item.
    unsigned int of(unsigned int item) const
    {
      while (parent[item] != item)
        item = parent[item] = parent[parent[item]]; // shorter ways for the next time
      return item;
    }

  private:
    mutable std::vector<unsigned int> parent;
  };

  /// How two joined surfaces lie to each other.
  struct JointMeasures
  {
    std::string name;
    double distance; ///< that is allowed, m
    double gap;      ///< the largest distance of paired points, m
    double overlap;  ///< common area, m^2
    double area;     ///< of the first, m^2
    std::string kind = "Tie";
  };

  /// The distance that a joint of surfaces may bridge, m: the given one, or where that is zero 5 %
  /// of the longest edge of their faces. Patches are of degree 2.
  double allowed_distance(double given, const std::vector<SurfaceFace<3>> &first,
                          const std::vector<SurfaceFace<3>> &second = {});

  /// The part of each face of the first surface that the second one faces, as allowed_distance()
  /// has the @p distance. Patches are of degree 2 with outward normals.
  std::vector<double> covered_parts(const std::vector<SurfaceFace<3>> &first,
                                    const std::vector<SurfaceFace<3>> &second, double distance);

  /// Measures how two surfaces lie to each other. The second must cover @p least_cover of the
  /// first, within the @p distance, m, or where that is zero within a part of the size of the
  /// faces. Patches are of degree 2 with outward normals. Throws InputError, @p where being the
  /// beginning of its message.
  JointMeasures check_joint(const std::string &where, const std::string &first_name,
                            const std::vector<SurfaceFace<3>> &first,
                            const std::string &second_name,
                            const std::vector<SurfaceFace<3>> &second, double distance,
                            double least_cover = 0.9);
} // namespace squeal
