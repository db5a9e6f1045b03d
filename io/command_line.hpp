// The command line of every program: options, flags and positional arguments bound to plain variables. The .cpp is the only
// file that names CLI11.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace slipstream {

class CommandLine {
 public:
  CommandLine(std::string program, std::string description);
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  // `flag` is "--name" or "-n,--name". The variable keeps its value, which the help shows as the default, when the option is
  // not given. Numbers are finite. The vector's option takes one value and may be repeated.
  void option(const std::string& flag, std::string& value, const std::string& help);
  void option(const std::string& flag, double& value, const std::string& help);
  void option(const std::string& flag, std::vector<std::string>& values, const std::string& help);
  void flag(const std::string& flag, bool& value, const std::string& help);
  void positional(const std::string& name, std::string& value, const std::string& help, bool required);
  void positionals(const std::string& name, std::vector<std::string>& values, const std::string& help);  // any number

  // --help prints the help and exits with 0. Wrong usage throws a Refusal.
  void parse(int argc, char** argv);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// The whole of a main(): runs the body and returns its exit code; a Refusal or any other exception becomes one line
// "PROGRAM: what is wrong" on stderr and exit code 1.
int run_main(const std::string& program, const std::function<int()>& body);

}  // namespace slipstream
