#include <squeal/mesh/intervals.h>

#include <cmath>

namespace squeal
{
  std::vector<double> graded_points(const double a, const double b, const unsigned int n,
                                    const unsigned int at_start, const unsigned int at_end,
                                    const double ratio)
  {
    const double h = (b - a) / n;
    // A single cell that is graded at both ends shares its width between them.
    const double width         = (n == 1 && at_start > 0 && at_end > 0) ? h / 2 : h;
    std::vector<double> points = {a};
    for (unsigned int k = at_start; k > 0; --k)
      points.push_back(a + width * std::pow(ratio, k));
    for (unsigned int i = 1; i < n; ++i)
      points.push_back(a + i * h);
    for (unsigned int k = 1; k <= at_end; ++k)
      points.push_back(b - width * std::pow(ratio, k));
    points.push_back(b);
    return points;
  }

  std::vector<double> aligned_points(const double a, const double b, const unsigned int n,
                                     const std::vector<double> &lines)
  {
    std::vector<double> ends = {a};
    for (const double line : lines)
      if (line > ends.back() + 1e-6 * (b - a) && line < b - 1e-6 * (b - a))
        ends.push_back(line);
    ends.push_back(b);
    if (n + 1 < ends.size())
      ends = {a, b};
    // Each interval has a cell; one more goes where cells are longest.
    std::vector<unsigned int> counts(ends.size() - 1, 1);
    for (unsigned int k = counts.size(); k < n; ++k)
    {
      unsigned int longest = 0;
      for (unsigned int i = 1; i < counts.size(); ++i)
        if ((ends[i + 1] - ends[i]) / counts[i] >
            (1 + 1e-9) * (ends[longest + 1] - ends[longest]) / counts[longest])
          longest = i;
      ++counts[longest];
    }
    std::vector<double> points = {a};
    for (unsigned int i = 0; i < counts.size(); ++i)
      for (unsigned int k = 1; k <= counts[i]; ++k)
        points.push_back(k == counts[i] ? ends[i + 1]
                                        : ends[i] + k * (ends[i + 1] - ends[i]) / counts[i]);
    return points;
  }
} // namespace squeal
