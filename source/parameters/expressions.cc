#include <squeal/base/errors.h>
#include <squeal/parameters/expressions.h>

#include <deal.II/base/function_parser.h>

#include <cmath>
#include <iostream>
#include <memory>
#include <regex>
#include <sstream>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// Keeps what deal.II prints about an expression that cannot be read, before it throws.
    class ErrorOutput
    {
    public:
      ErrorOutput() : before(std::cerr.rdbuf(text.rdbuf())) {}
      ~ErrorOutput()
      {
        std::cerr.rdbuf(before);
      }
      /// The reason, as " Unexpected end of expression at position 4."; empty: it gave none.
      std::string reason() const
      {
        const std::string all = text.str(), mark = "Message:  <";
        const std::size_t begin = all.find(mark), end = all.find(">\nFormula:");
        if (begin == std::string::npos || end == std::string::npos)
          return "";
        return " " + all.substr(begin + mark.size(), end - begin - mark.size()) + ".";
      }

    private:
      std::ostringstream text;
      std::streambuf *before;
    };

    template <int n_variables>
    std::shared_ptr<FunctionParser<n_variables>>
    parse(const std::string &text, const std::string &variables, const std::string &key)
    {
      // A run must give the same results again.
      if (std::regex_search(text, std::regex("\\brand(_seed)?\\b")))
        throw InputError(key + " = " + text +
                         ": rand and rand_seed are not allowed, since such a run does not repeat.");
      auto parser = std::make_shared<FunctionParser<n_variables>>();
      const ErrorOutput output;
      try
      {
        parser->initialize(variables, text, {{"pi", numbers::PI}});
        parser->value(Point<n_variables>()); // deal.II reads the text at its first use
      }
      catch (const std::exception &)
      {
        throw InputError(key + " = " + text + ": the expression cannot be read." + output.reason() +
                         " Variables are " + variables +
                         "; for example exp, sqrt, if(condition, a, b) and pi are known.");
      }
      return parser;
    }
  } // namespace

  template <int dim>
  std::function<double(const Point<dim> &)> position_expression(const std::string &text,
                                                                const std::string &key)
  {
    const auto parser = parse<dim>(text, dim == 3 ? "x,y,z" : "x,y", key);
    return [=](const Point<dim> &x)
    {
      const double value = parser->value(x);
      if (!std::isfinite(value))
        throw InputError(key + " = " + text + ": the expression is not finite at x = " +
                         std::to_string(x[0]) + ", y = " + std::to_string(x[1]) + ".");
      return value;
    };
  }

  std::optional<double> constant_expression(const std::string &text)
  {
    const std::string characters = "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                   ".+-*/^() \t";
    if (text.find_first_not_of(characters) != std::string::npos ||
        text.find_first_of("+-*/^(") == std::string::npos)
      return std::nullopt;
    try
    {
      const double value = parse<1>(text, "no_variable", "")->value(Point<1>());
      return std::isfinite(value) ? std::optional<double>(value) : std::nullopt;
    }
    catch (const InputError &)
    {
      return std::nullopt;
    }
  }

  std::function<double(double, double)> friction_expression(const std::string &text,
                                                            const std::string &key)
  {
    const auto parser = parse<2>(text, "v,p", key);
    return [=](const double v, const double p)
    {
      const double value = parser->value(Point<2>(v, p));
      if (!std::isfinite(value))
        throw InputError(key + " = " + text + ": the expression is not finite at v = " +
                         std::to_string(v) + " m/s, p = " + std::to_string(p) + " Pa.");
      return value;
    };
  }

  template std::function<double(const Point<2> &)> position_expression(const std::string &,
                                                                       const std::string &);
  template std::function<double(const Point<3> &)> position_expression(const std::string &,
                                                                       const std::string &);
} // namespace squeal
