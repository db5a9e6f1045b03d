// Strict reading of TOML into plain fields. What is read is checked and printed in one go, so the printed text names every
// key there is, defaults included, and reads back to the same bits. The .cpp is the only file that names the TOML parser.
//
// Every refusal is one line: FILE:LINE:COLUMN: table.key: found ..., expected ...
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/parameters.hpp"
#include "common/types.hpp"

namespace slipstream {

// What a text must look like, and the words for it in "expected ...".
struct TextForm {
  bool (*accepts)(const std::string&);
  const char* expected;
};

// One table of a document. Each reading method takes `key` into the field, which keeps its default when the key is absent,
// refuses a wrong type or value, and prints the key. It is a visitor for visit_parameters of common/parameters.hpp.
// Plain keys must be read before sub-tables, as TOML prints them in that order.
class TomlTable {
 public:
  struct Impl;
  using Body = std::function<void(TomlTable&)>;

  explicit TomlTable(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}

  void number(const std::string& key, double& field, const Range& range);
  void list(const std::string& key, std::vector<double>& field, const Range& each);
  void triple(const std::string& key, Vector<double, 3>& field, const Range& each);  // a list of three numbers
  void choice(const std::string& key, std::string& field, const Choices& options);
  void choices(const std::string& key, std::vector<std::string>& field, const Choices& options);  // a list, none needed
  void flag(const std::string& key, bool& field);

  template <typename Integer>
  void integer(const std::string& key, Integer& field, std::int64_t min, std::int64_t max) {
    field = static_cast<Integer>(read_integer(key, static_cast<std::int64_t>(field), min, max));
  }
  void text(const std::string& key, std::string& field, const TextForm& form);
  void texts(const std::string& key, std::vector<std::string>& field, const TextForm& form);  // a list without repetitions
  void type(std::string& field, const Choices& options);                                      // the key `type`, required
  // A table of numbers by name; `names` are the admissible keys. Printed inline, only if it is not empty.
  void numbers(const std::string& key, std::map<std::string, double>& field, const std::vector<std::string>& names,
               const std::vector<std::string>& required, const Range& range);

  // A sub-table of lists under dotted keys, quoted or not: the TOML of each value, in the order of the file. At least one value
  // each, none twice.
  using Lists = std::vector<std::pair<std::string, std::vector<std::string>>>;
  void lists(const std::string& key, Lists& field);

  bool has(const std::string& key) const;
  std::vector<std::string> keys_of(const std::string& key) const;  // of a sub-table, sorted; empty if absent

  // Declares keys, so that others are refused at once and with a good suggestion.
  void only(const std::vector<std::string>& keys);
  // The key must be there; refused at the end of the table, after unknown keys, which are the likelier cause.
  void require(const std::string& key);

  // Reads a sub-table, or an absent one as if it were empty. Its unknown and missing keys are refused after the body.
  void table(const std::string& key, const Body& body);
  void tables(const std::string& key, const Body& body);  // [[key]]: once for each

  // The beginning of a refusal at the position of `key` in this table, or of the table if the key is absent.
  std::string where(const std::string& key) const;
  [[noreturn]] void refuse(const std::string& key, const std::string& what) const;

 private:
  friend class TomlDocument;

  std::int64_t read_integer(const std::string& key, std::int64_t value, std::int64_t min, std::int64_t max);

  std::shared_ptr<Impl> impl_;
};

// A parsed document whose values remember the file, line and column they came from, also after a merge.
class TomlDocument {
 public:
  // Refuses a syntax error. `source` names the text in error lines.
  TomlDocument(const std::string& text, const std::string& source);
  // One assignment "a.b=VALUE"; VALUE is TOML, or a bare word that stands for itself as text.
  static TomlDocument assignment(const std::string& text);
  ~TomlDocument();
  TomlDocument(TomlDocument&&) noexcept;
  TomlDocument& operator=(TomlDocument&&) noexcept;

  // Lays `overlay` over this document: tables are merged, other values replaced. A table whose `type` changes is replaced
  // whole.
  void merge(TomlDocument overlay);

  // Removes a text key of the root and returns it; empty if absent.
  std::string take_text(const std::string& key, std::string& position);

  // All values under dotted keys, one a line, sorted: reads back to the same document, without comments. Refuses tables in a
  // list.
  std::string flat_text() const;

  // Reads the root table; returns what was printed.
  std::string read(const TomlTable::Body& body) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace slipstream
