#include "io/toml_reader.hpp"

// The parser asserts (or, with NDEBUG and clang, assumes) that a table header goes on with a key, which "[[[" in a file breaks;
// its own code reports that as a syntax error if it is let (marzer/tomlplusplus pull request 301).
#undef NDEBUG
#define TOML_ASSERT(condition) static_cast<void>(0)
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>

#include "common/check.hpp"
#include "common/refusal.hpp"
#include "io/suggest.hpp"
#include "io/text_file.hpp"
#include "io/toml_text.hpp"

namespace slipstream {
namespace {

constexpr std::size_t kMostNumbers = 10000;  // of a list: a scenario may come from the bus
constexpr std::string_view kAssignment = "override '";

// "FILE:LINE:COLUMN: ", or less where less is known.
std::string position_of(const toml::source_region& source, const std::string& fallback) {
  const std::string file = source.path ? *source.path : fallback;
  if (!source.begin || std::string_view(file).starts_with(kAssignment)) return file + ": ";
  return file + ":" + std::to_string(source.begin.line) + ":" + std::to_string(source.begin.column) + ": ";
}

std::string found(const toml::node& node) {
  if (const auto* text = node.as_string()) return "\"" + printable(text->get()) + "\"";
  if (const auto* integer = node.as_integer()) return std::to_string(integer->get());
  if (const auto* number = node.as_floating_point()) return digits(number->get());
  if (const auto* flag = node.as_boolean()) return flag->get() ? "true" : "false";
  return node.is_table() ? "a table" : node.is_array() ? "a list" : "a date or time";
}

// --- Merging ----------------------------------------------------------------------------------------------------------

bool changes_type(const toml::table& present, const toml::table& overlay) {
  const toml::node* const before = present.get("type");
  const toml::node* const after = overlay.get("type");
  return before && after && before->value<std::string>() != after->value<std::string>();
}

void merge_tables(toml::table& into, toml::table& from) {
  for (auto&& [key, node] : from) {
    toml::node* const present = into.get(key.str());
    if (present && present->is_table() && node.is_table() && !changes_type(*present->as_table(), *node.as_table())) {
      merge_tables(*present->as_table(), *node.as_table());
      continue;
    }
    if (present) into.erase(key.str());  // the new key keeps its own position
    node.visit([&into, &name = key](auto& value) { into.insert(name, std::move(value)); });  // a move keeps positions
  }
}

// --- Values -----------------------------------------------------------------------------------------------------------

// A value as TOML prints it; empty of a table, a date, or a list that holds one.
std::string toml_value(const toml::node& node) {
  if (const auto* text = node.as_string()) return toml_text(text->get());
  if (const auto* number = node.as_floating_point()) return std::isfinite(number->get()) ? toml_number(number->get()) : "";
  if (node.is_integer() || node.is_boolean()) return found(node);
  if (!node.is_array()) return "";
  std::string inner;
  for (const toml::node& item : *node.as_array()) {
    const std::string value = toml_value(item);
    if (value.empty()) return "";
    inner += (inner.empty() ? "" : ", ") + value;
  }
  return bracketed(inner);
}

std::string toml_key(const std::string& key) {
  const auto bare = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '-'; };
  return !key.empty() && std::all_of(key.begin(), key.end(), bare) ? key : toml_text(key);
}

// What a nest of tables holds, under dotted keys; an empty table counts as a value.
struct Leaf {
  std::string key;
  const toml::node* node;
  toml::source_position begin;
};
void collect_leaves(const toml::table& table, const std::string& prefix, bool quoted, std::vector<Leaf>& leaves) {
  for (auto&& [key, node] : table) {
    const std::string name = prefix + (quoted ? toml_key(std::string(key.str())) : std::string(key.str()));
    if (node.is_table() && !node.as_table()->empty())
      collect_leaves(*node.as_table(), name + ".", quoted, leaves);
    else
      leaves.push_back({name, &node, node.source().begin});
  }
}

// The printed text and the table whose keys are being printed. Tables are numbered as they are entered.
struct Printer {
  std::string text;
  int entered = 0;
  int open = 0;
};

}  // namespace

// --- One table --------------------------------------------------------------------------------------------------------

struct TomlTable::Impl {
  const toml::table* table;  // null: absent
  std::string path;          // "sensor.wheel_speed"; empty: the root
  std::string header;        // "[sensor.wheel_speed]"
  std::string here;          // position of the table
  std::string document;
  Printer* printer = nullptr;
  std::vector<std::string> known{};
  std::vector<std::string> required{};
  int number = printer ? printer->entered++ : 0;

  const toml::node* find(const std::string& key) {
    known.push_back(key);
    return table ? table->get(key) : nullptr;
  }
  std::string name(const std::string& key) const { return path.empty() ? key : path + "." + key; }
  std::string place() const { return path.empty() ? "" : " in " + header; }
  std::string position(const toml::node& node) const { return position_of(node.source(), document); }

  [[noreturn]] void refuse(const toml::node& node, const std::string& key, const std::string& what) const {
    throw Refusal(position(node) + name(key) + ": found " + found(node) + ", expected " + what);
  }

  void print(const std::string& key, const std::string& value) {
    if (printer->open != number) {
      SLIPSTREAM_CHECK(printer->open < number);  // a plain key after a sub-table would land in the sub-table
      printer->text += (printer->text.empty() ? "" : "\n") + header + "\n";
      printer->open = number;
    }
    printer->text += key + " = " + value + "\n";
  }

  double number_of(const toml::node& node, const std::string& key, const Range& range) const {
    const auto value = node.is_number() ? node.value<double>() : std::nullopt;
    if (!value) refuse(node, key, expected_number(range));
    if (!std::isfinite(*value) || !range.contains(*value)) refuse(node, key, expected_number(range, std::isfinite(*value)));
    return *value;
  }

  std::string text_of(const toml::node& node, const std::string& key, const TextForm& form) const {
    const auto* const text = node.as_string();
    if (!text || !form.accepts(text->get())) refuse(node, key, form.expected);
    return text->get();
  }

  [[noreturn]] void refuse_key(const toml::key& key) const {
    const std::string word(key.str());
    throw Refusal(position_of(key.source(), document) + "unknown key '" + printable(word) + "'" + place() +
                  suggestion(word, known));
  }

  // The unknown key that comes first in the file.
  void refuse_unknown() const {
    if (!table) return;
    const toml::key* first = nullptr;
    for (auto&& [key, node] : *table) {
      if (std::find(known.begin(), known.end(), key.str()) != known.end()) continue;
      if (!first || key.source().begin < first->source().begin) first = &key;
    }
    if (first) refuse_key(*first);
  }

  void finish() const {
    refuse_unknown();
    for (const std::string& key : required)
      if (!table || !table->contains(key)) throw Refusal(here + "missing key '" + key + "'" + place());
  }
};

void TomlTable::number(const std::string& key, double& field, const Range& range) {
  if (const toml::node* const node = impl_->find(key)) field = impl_->number_of(*node, key, range);
  // A default may come from elsewhere, such as the vehicle's parameter of that name.
  if (!range.contains(field)) refuse(key, "the default is " + digits(field) + ", expected " + expected_number(range));
  impl_->print(key, toml_number(field));
}

void TomlTable::list(const std::string& key, std::vector<double>& field, const Range& each) {
  if (const toml::node* const node = impl_->find(key)) {
    const toml::array* const items = node->as_array();
    const bool may_be_empty = field.empty();  // as the default is
    if (!items || (items->empty() && !may_be_empty))
      impl_->refuse(*node, key, items ? "a list of at least one number" : "a list of numbers");
    if (items->size() > kMostNumbers)
      impl_->refuse(*node, key, "a list of at most " + std::to_string(kMostNumbers) + " numbers");
    field.clear();
    for (const toml::node& item : *items) field.push_back(impl_->number_of(item, key, each));
  }
  impl_->print(key, bracketed(joined(field, toml_number)));
}

void TomlTable::triple(const std::string& key, Vector<double, 3>& field, const Range& each) {
  if (const toml::node* const node = impl_->find(key)) {
    const toml::array* const items = node->as_array();
    if (!items || items->size() != 3) impl_->refuse(*node, key, "a list of three numbers");
    for (int i = 0; i < 3; ++i) field[i] = impl_->number_of((*items)[static_cast<std::size_t>(i)], key, each);
  }
  impl_->print(key, bracketed(joined(field, toml_number)));
}

void TomlTable::choice(const std::string& key, std::string& field, const Choices& options) {
  if (const toml::node* const node = impl_->find(key)) {
    const auto* const text = node->as_string();
    if (!text || std::find(options.begin(), options.end(), text->get()) == options.end())
      impl_->refuse(*node, key, expected_choice(options));
    field = text->get();
  } else if (std::find(options.begin(), options.end(), field) == options.end()) {
    refuse(key, "the default is " + toml_text(field) + ", expected " + expected_choice(options));
  }
  impl_->print(key, toml_text(field));
}

void TomlTable::choices(const std::string& key, std::vector<std::string>& field, const Choices& options) {
  if (const toml::node* const node = impl_->find(key)) {
    const toml::array* const items = node->as_array();
    if (!items) impl_->refuse(*node, key, "a list, each " + expected_choice(options));
    if (items->size() > kMostNumbers) impl_->refuse(*node, key, "a list of at most " + std::to_string(kMostNumbers) + " names");
    field.clear();
    for (const toml::node& item : *items) {
      const auto* const text = item.as_string();
      if (!text || std::find(options.begin(), options.end(), text->get()) == options.end())
        impl_->refuse(item, key, expected_choice(options));
      field.push_back(text->get());
    }
  }
  impl_->print(key, bracketed(joined(field, toml_text)));
}

void TomlTable::flag(const std::string& key, bool& field) {
  if (const toml::node* const node = impl_->find(key)) {
    if (!node->is_boolean()) impl_->refuse(*node, key, "true or false");
    field = node->as_boolean()->get();
  }
  impl_->print(key, field ? "true" : "false");
}

std::int64_t TomlTable::read_integer(const std::string& key, std::int64_t value, std::int64_t min, std::int64_t max) {
  if (const toml::node* const node = impl_->find(key)) {
    const auto* const integer = node->as_integer();
    if (!integer || integer->get() < min || integer->get() > max)
      impl_->refuse(*node, key, "a whole number from " + std::to_string(min) + " to " + std::to_string(max));
    value = integer->get();
  }
  impl_->print(key, std::to_string(value));
  return value;
}

void TomlTable::text(const std::string& key, std::string& field, const TextForm& form) {
  if (const toml::node* const node = impl_->find(key)) field = impl_->text_of(*node, key, form);
  impl_->print(key, toml_text(field));
}

void TomlTable::texts(const std::string& key, std::vector<std::string>& field, const TextForm& form) {
  if (const toml::node* const node = impl_->find(key)) {
    const toml::array* const items = node->as_array();
    if (!items) impl_->refuse(*node, key, std::string("a list, each ") + form.expected);
    field.clear();
    for (const toml::node& item : *items) {
      const std::string text = impl_->text_of(item, key, form);
      if (std::find(field.begin(), field.end(), text) != field.end())
        throw Refusal(impl_->position(item) + impl_->name(key) + ": " + found(item) + " appears twice");
      field.push_back(text);
    }
  }
  impl_->print(key, bracketed(joined(field, toml_text)));
}

void TomlTable::type(std::string& field, const Choices& options) {
  if (!has("type")) {
    impl_->known = {"type"};  // without the type the other keys cannot be judged; a misspelt `type` can
    if (impl_->table)
      for (auto&& [key, node] : *impl_->table)
        if (nearest(std::string(key.str()), impl_->known)) impl_->refuse_key(key);
    throw Refusal(impl_->here + "missing key 'type'" + impl_->place() + ", expected " + expected_choice(options));
  }
  field = options.front();
  choice("type", field, options);
}

void TomlTable::numbers(const std::string& key, std::map<std::string, double>& field, const std::vector<std::string>& names,
                        const std::vector<std::string>& required, const Range& range) {
  if (const toml::node* const node = impl_->find(key)) {
    if (!node->is_table()) impl_->refuse(*node, key, "a table of numbers");
    const std::string path = impl_->name(key);
    const Impl inner{node->as_table(), path,    bracketed(path), impl_->position(*node),
                     impl_->document,  nullptr, names,           required};
    inner.finish();
    for (auto&& [name, value] : *node->as_table()) {
      const std::string item(name.str());
      field[item] = inner.number_of(value, item, range);
    }
  } else if (!required.empty() && !std::all_of(required.begin(), required.end(), [&](auto& n) { return field.contains(n); })) {
    throw Refusal(impl_->here + "missing key '" + key + "'" + impl_->place() + ", expected a number for each of " +
                  joined(required, [](const std::string& name) { return name; }));
  }
  if (field.empty()) return;
  impl_->print(key,
               "{ " + joined(field, [](const auto& item) { return item.first + " = " + toml_number(item.second); }) + " }");
}

void TomlTable::lists(const std::string& key, Lists& field) {
  table(key, [&](TomlTable& t) {
    if (!t.impl_->table) return;
    std::vector<Leaf> leaves;
    collect_leaves(*t.impl_->table, "", false, leaves);
    std::sort(leaves.begin(), leaves.end(), [](const Leaf& a, const Leaf& b) { return a.begin < b.begin; });
    for (auto&& [name, node] : *t.impl_->table) t.impl_->known.emplace_back(name.str());
    for (const Leaf& leaf : leaves) {
      const toml::array* const items = leaf.node->as_array();
      if (!items || items->empty()) t.impl_->refuse(*leaf.node, leaf.key, "a list of at least one value");
      std::vector<std::string> values;
      for (const toml::node& item : *items) {
        const std::string value = toml_value(item);
        if (value.empty()) t.impl_->refuse(item, leaf.key, "a number, text, true, false, or a list of these");
        if (std::find(values.begin(), values.end(), value) != values.end())
          throw Refusal(t.impl_->position(item) + t.impl_->name(leaf.key) + ": " + found(item) + " appears twice");
        values.push_back(value);
      }
      t.impl_->print(toml_text(leaf.key), bracketed(joined(values, [](const std::string& value) { return value; })));
      field.emplace_back(leaf.key, values);
    }
  });
}

bool TomlTable::has(const std::string& key) const { return impl_->table && impl_->table->contains(key); }

std::vector<std::string> TomlTable::keys_of(const std::string& key) const {
  const toml::node* const node = impl_->table ? impl_->table->get(key) : nullptr;
  if (node && !node->is_table()) impl_->refuse(*node, key, "a table");
  std::vector<std::string> keys;
  if (node)
    for (auto&& [name, value] : *node->as_table()) keys.emplace_back(name.str());
  return keys;
}

void TomlTable::only(const std::vector<std::string>& keys) {
  impl_->known.insert(impl_->known.end(), keys.begin(), keys.end());
  impl_->refuse_unknown();
}

void TomlTable::require(const std::string& key) { impl_->required.push_back(key); }

void TomlTable::table(const std::string& key, const Body& body) {
  const toml::node* const node = impl_->find(key);
  if (node && !node->is_table()) impl_->refuse(*node, key, "a table");
  const std::string path = impl_->name(key);
  TomlTable inner(std::make_shared<Impl>(Impl{node ? node->as_table() : nullptr, path, bracketed(path),
                                              node ? impl_->position(*node) : impl_->here, impl_->document, impl_->printer}));
  body(inner);
  inner.impl_->finish();
}

void TomlTable::tables(const std::string& key, const Body& body) {
  const toml::node* const node = impl_->find(key);
  if (!node) return;
  const toml::array* const items = node->as_array();
  if (!items) impl_->refuse(*node, key, "a list of tables");
  const std::string path = impl_->name(key);
  for (const toml::node& item : *items) {
    if (!item.is_table()) impl_->refuse(item, key, "a list of tables");
    TomlTable inner(std::make_shared<Impl>(
        Impl{item.as_table(), path, bracketed(bracketed(path)), impl_->position(item), impl_->document, impl_->printer}));
    body(inner);
    inner.impl_->finish();
  }
}

std::string TomlTable::where(const std::string& key) const {
  const toml::node* const node = impl_->table ? impl_->table->get(key) : nullptr;
  return (node ? impl_->position(*node) : impl_->here) + impl_->name(key) + ": ";
}

void TomlTable::refuse(const std::string& key, const std::string& what) const { throw Refusal(where(key) + what); }

// --- A document -------------------------------------------------------------------------------------------------------

struct TomlDocument::Impl {
  toml::table root;
  std::string source;
};

TomlDocument::TomlDocument(const std::string& text, const std::string& source) : impl_(std::make_unique<Impl>()) {
  impl_->source = source;
  try {
    impl_->root = toml::parse(text, source);
  } catch (const toml::parse_error& error) {
    throw Refusal(position_of(error.source(), source) + "syntax error: " + std::string(error.description()));
  }
}
TomlDocument::~TomlDocument() = default;
TomlDocument::TomlDocument(TomlDocument&&) noexcept = default;
TomlDocument& TomlDocument::operator=(TomlDocument&&) noexcept = default;

TomlDocument TomlDocument::assignment(const std::string& text) {
  const std::string source = std::string(kAssignment) + printable(text) + "'";
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || text.find_first_of("\r\n") != std::string::npos)
    throw Refusal(source + ": expected table.key=value");
  std::string value = text.substr(equals + 1);
  value.erase(0, value.find_first_not_of(" \t"));
  const auto word = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.' || c == '/'; };
  const bool bare = !value.empty() && (std::isalpha(static_cast<unsigned char>(value[0])) != 0 || value[0] == '_') &&
                    std::all_of(value.begin(), value.end(), word);
  if (bare && value != "true" && value != "false" && value != "inf" && value != "nan") value = toml_text(value);
  TomlDocument document(text.substr(0, equals) + " = " + value, source);
  if (document.impl_->root.empty()) throw Refusal(source + ": expected table.key=value");
  return document;
}

void TomlDocument::merge(TomlDocument overlay) { merge_tables(impl_->root, overlay.impl_->root); }

std::string TomlDocument::take_text(const std::string& key, std::string& position) {
  const toml::node* const node = impl_->root.get(key);
  if (!node) return "";
  position = position_of(node->source(), impl_->source) + key + ": ";
  if (!node->is_string() || node->as_string()->get().empty())
    throw Refusal(position + "found " + found(*node) + ", expected text");
  const std::string text = node->as_string()->get();
  impl_->root.erase(key);
  return text;
}

std::string TomlDocument::flat_text() const {
  std::vector<Leaf> leaves;
  collect_leaves(impl_->root, "", true, leaves);
  std::string text;
  for (const Leaf& leaf : leaves) {
    const std::string value = leaf.node->is_table() ? "{}" : toml_value(*leaf.node);
    if (value.empty()) throw Refusal(position_of(leaf.node->source(), impl_->source) + leaf.key + ": cannot stand in one line");
    text += leaf.key + " = " + value + "\n";
  }
  return text;
}

std::string TomlDocument::read(const TomlTable::Body& body) const {
  Printer printer;
  TomlTable root(
      std::make_shared<TomlTable::Impl>(TomlTable::Impl{&impl_->root, "", "", impl_->source + ": ", impl_->source, &printer}));
  body(root);
  root.impl_->finish();
  return printer.text;
}

}  // namespace slipstream
