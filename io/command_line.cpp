#include "io/command_line.hpp"

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>

#include "common/refusal.hpp"
#include "io/suggest.hpp"

namespace slipstream {
namespace {

std::string one_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  for (char& c : text)
    if (c == '\n' || c == '\r') c = ' ';
  return text;
}

double parse_number(const std::string& flag, const std::string& text) {
  double number = 0.0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc() || rest != end || !std::isfinite(number))
    throw Refusal(flag + ": found '" + text + "', expected a number");
  return number;
}

}  // namespace

struct CommandLine::Impl {
  Impl(const std::string& program, const std::string& description) : app(description, program) {
    app.allow_extras();
    app.get_formatter()->column_width(36);
    flags = {"-h", "--help"};
  }

  // CLI11 hands every value over as text; a value that looks like an option is one whose own value was forgotten.
  template <typename Accept>
  CLI::Option* add(const std::string& flag, const std::string& help, const std::string& type, bool repeatable, Accept accept) {
    remember(flag);
    const auto take = [name = flags.back(), repeatable, accept](const CLI::results_t& values) {
      if (!repeatable && values.size() > 1) throw Refusal(name + ": given twice");
      for (const std::string& value : values) {
        if (value.starts_with("--")) throw Refusal(name + ": expected a value, found the option '" + value + "'");
        accept(name, value);
      }
      return true;
    };
    return app.add_option(flag, take, help)
        ->type_name(type)
        ->type_size(1)
        ->allow_extra_args(false)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  }

  // "-s,--speed" counts as both.
  void remember(const std::string& names) {
    for (std::size_t begin = 0; begin <= names.size();) {
      const std::size_t end = std::min(names.find(',', begin), names.size());
      flags.push_back(names.substr(begin, end - begin));
      begin = end + 1;
    }
  }

  CLI::App app;
  std::vector<std::string> flags;
  std::vector<const CLI::Option*> required_positionals;
};

CommandLine::CommandLine(std::string program, std::string description) : impl_(std::make_unique<Impl>(program, description)) {}
CommandLine::~CommandLine() = default;

void CommandLine::option(const std::string& flag, std::string& value, const std::string& help) {
  const auto accept = [&value](const std::string&, const std::string& text) { value = text; };
  CLI::Option* const option = impl_->add(flag, help, "TEXT", false, accept);
  if (!value.empty()) option->default_str(value);
}

void CommandLine::option(const std::string& flag, double& value, const std::string& help) {
  const auto accept = [&value](const std::string& name, const std::string& text) { value = parse_number(name, text); };
  char shown[32];
  std::snprintf(shown, sizeof shown, "%g", value);
  impl_->add(flag, help, "NUMBER", false, accept)->default_str(shown);
}

void CommandLine::option(const std::string& flag, std::vector<std::string>& values, const std::string& help) {
  const auto accept = [&values](const std::string&, const std::string& text) { values.push_back(text); };
  impl_->add(flag, help, "TEXT ...", true, accept);  // "..." in the help: may be repeated
}

void CommandLine::flag(const std::string& flag, bool& value, const std::string& help) {
  impl_->remember(flag);
  impl_->app.add_flag_callback(
      flag, [&value] { value = true; }, help);
}

void CommandLine::positional(const std::string& name, std::string& value, const std::string& help, bool required) {
  const CLI::Option* const option = impl_->app.add_option(name, value, help)->type_name("")->required(required);
  if (required) impl_->required_positionals.push_back(option);
}

void CommandLine::positionals(const std::string& name, std::vector<std::string>& values, const std::string& help) {
  impl_->app.add_option(name, values, help)->type_name("");
}

void CommandLine::parse(int argc, char** argv) {
  CLI::App& app = impl_->app;
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    std::cout << app.help() << std::flush;
    std::exit(0);
  } catch (const CLI::RequiredError&) {
    // Below, after the unknown options, which are the likelier cause.
  } catch (const CLI::ArgumentMismatch& error) {
    const std::string line = one_line(error.what());
    throw Refusal(line.substr(0, line.find(':')) + ": expected a value; see --help");
  } catch (const CLI::ParseError& error) {
    throw Refusal(one_line(error.what()) + "; see --help");
  }
  for (const std::string& extra : app.remaining()) {
    if (!extra.starts_with("-")) throw Refusal("unexpected argument '" + extra + "'; see --help");
    const std::string name = extra.substr(0, extra.find('='));
    const auto near = nearest(name, impl_->flags);
    throw Refusal("unknown option '" + name + "'; " + (near ? "did you mean '" + *near + "'?" : "see --help"));
  }
  for (const CLI::Option* const option : impl_->required_positionals)
    if (option->count() == 0) throw Refusal("missing argument '" + option->get_name() + "'; see --help");
}

int run_main(const std::string& program, const std::function<int()>& body) {
  std::string line;
  try {
    return body();
  } catch (const Refusal& refusal) {
    line = refusal.what();
  } catch (const std::exception& error) {
    line = std::string("internal error: ") + error.what();
  }
  std::fprintf(stderr, "%s: %s\n", program.c_str(), one_line(line).c_str());
  return 1;
}

}  // namespace slipstream
