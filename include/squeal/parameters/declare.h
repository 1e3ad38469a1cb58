#pragma once

#include <squeal/base/errors.h>
#include <squeal/base/names.h>
#include <squeal/base/text.h>

#include <deal.II/base/parameter_handler.h>

#include <limits>
#include <string>

namespace squeal::Parameters
{
  using dealii::ParameterHandler;
  namespace Patterns = dealii::Patterns;

  constexpr double smallest = std::numeric_limits<double>::min();

  inline Patterns::Double positive()
  {
    return Patterns::Double(smallest, Patterns::Double::max_double_value);
  }
  inline Patterns::Double not_negative()
  {
    return Patterns::Double(0, Patterns::Double::max_double_value);
  }

  /// Keys declared in its lifetime belong to the subsection.
  class Subsection
  {
  public:
    Subsection(ParameterHandler &prm, const std::string &name) : prm(prm)
    {
      prm.enter_subsection(name);
    }
    ~Subsection()
    {
      prm.leave_subsection();
    }
    Subsection(const Subsection &)            = delete;
    Subsection &operator=(const Subsection &) = delete;

  private:
    ParameterHandler &prm;
  };

  /// A key whose value is one of the names of an enumeration.
  template <typename Enum>
  void add_choice(ParameterHandler &prm, const std::string &key, Enum &value,
                  const std::string &documentation)
  {
    prm.declare_entry(key, name_of(value), Patterns::Selection(all_names<Enum>("|")),
                      documentation);
    prm.add_action(key, [&value](const std::string &name) { value = value_named<Enum>(name); });
  }

  /// Refuses the value of a key. Throws InputError.
  template <typename Value>
  [[noreturn]] void fail(const std::string &key, const Value &value,
                         const std::string &what_is_allowed)
  {
    throw InputError(text_of(key, " = ", value, ": ", what_is_allowed));
  }
} // namespace squeal::Parameters
