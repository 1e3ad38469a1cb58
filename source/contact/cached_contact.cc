#include <squeal/contact/contact.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  using namespace dealii;

  template <int dim>
  std::shared_ptr<const Matrix> Contact<dim>::shared_normal() const
  {
    const std::vector<double> constants = constants_of_normal();
    int is_kept                         = kept_normal.is_of(*this, constants);
    MPI_Allreduce(MPI_IN_PLACE, &is_kept, 1, MPI_INT, MPI_MIN, space->comm);
    if (!is_kept)
      kept_normal = {
          active, active_points, constants, {}, std::make_shared<const Matrix>(normal())};
    return kept_normal.matrix;
  }

  template <int dim>
  std::pair<double, typename Contact<dim>::Pressure>
  Contact<dim>::friction_slopes(const Pressure &pressure) const
  {
    Pressure slopes = uniform_pressure(0);
    double largest  = 0;
    for_each_pair(
        [&](const unsigned int i, const Kinematics &k)
        {
          for (unsigned int q = 0; q < k.n_points; ++q)
          {
            double &slope = slopes[i][k.first_point + q];
            slope = model.friction.traction(k.speeds[q], pressure[i][k.first_point + q]).d_pressure;
            largest = std::max(largest, std::abs(slope));
          }
        });
    largest = Utilities::MPI::max(largest, space->comm);
    if (largest > 0)
      for (std::vector<double> &of_interface : slopes)
        for (double &slope : of_interface)
          slope /= largest;
    return {largest, std::move(slopes)};
  }

  template <int dim>
  std::pair<double, std::shared_ptr<const Matrix>>
  Contact<dim>::shared_friction(const Pressure &pressure) const
  {
    auto [largest, slopes] = friction_slopes(pressure);
    if (largest == 0)
      return {0., std::make_shared<const Matrix>(tangential(slopes))};
    const std::vector<double> constants = {double(model.mortar), scale, model.penalty_stiffness};
    int is_kept = kept_friction.is_of(*this, constants) && kept_friction.coefficients == slopes;
    MPI_Allreduce(MPI_IN_PLACE, &is_kept, 1, MPI_INT, MPI_MIN, space->comm);
    if (!is_kept)
      kept_friction = {active, active_points, constants, slopes,
                       std::make_shared<const Matrix>(tangential(slopes))};
    return {largest, kept_friction.matrix};
  }

  template std::shared_ptr<const Matrix> Contact<2>::shared_normal() const;
  template std::shared_ptr<const Matrix> Contact<3>::shared_normal() const;
  template std::pair<double, std::shared_ptr<const Matrix>>
  Contact<2>::shared_friction(const Contact<2>::Pressure &) const;
  template std::pair<double, std::shared_ptr<const Matrix>>
  Contact<3>::shared_friction(const Contact<3>::Pressure &) const;
  template std::pair<double, Contact<2>::Pressure>
  Contact<2>::friction_slopes(const Contact<2>::Pressure &) const;
  template std::pair<double, Contact<3>::Pressure>
  Contact<3>::friction_slopes(const Contact<3>::Pressure &) const;
} // namespace squeal
