#include <fmt/format.h>

#include <filesystem>
#include <iterator>
#include <map>
#include <stdexcept>

#include "common/bus/channels.h"
#include "logs/src/export.h"
#include "logs/src/log_reader.h"
#include "logs/src/message_fields.h"
#include "logs/src/output.h"

namespace chase::logs {
namespace {

std::string Quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

std::string Header(const std::vector<Field>& fields) {
  std::string line = "event_utime";
  for (const Field& f : fields) {
    if (f.is_list || f.numbers.size() < 2)
      line += "," + f.path;
    else
      for (size_t i = 0; i < f.numbers.size(); ++i) line += fmt::format(",{}.{}", f.path, i);
  }
  return line + "\n";
}

std::string Cells(const Field& f) {
  std::string cells;
  if (!f.texts.empty()) {
    for (size_t i = 0; i < f.texts.size(); ++i) cells += (i ? " " : "") + f.texts[i];
    return Quoted(cells);
  }
  const char* separator = f.is_list ? " " : ",";
  for (size_t i = 0; i < f.numbers.size(); ++i)
    fmt::format_to(std::back_inserter(cells), "{}{}", i ? separator : "", f.numbers[i]);
  return cells;
}

/// Lists of structs that are empty have no fields at all; the row still has to line up.
std::string Row(const Event& event, const std::vector<Field>& fields,
                const std::vector<std::string>& paths) {
  std::string line = std::to_string(event.utime);
  size_t next = 0;
  for (const std::string& path : paths) {
    line += ",";
    if (next < fields.size() && fields[next].path == path) line += Cells(fields[next++]);
  }
  return line + "\n";
}

class Table {
 public:
  void Add(const Event& event) {
    const auto fields = FieldsOf(event.bytes);
    if (!fields) return;
    rows_.push_back({event.utime, *fields});
  }
  bool empty() const { return rows_.empty(); }

  std::string Text() const {
    const auto widest = Widest();
    std::vector<std::string> paths;
    for (const Field& f : widest) paths.push_back(f.path);
    std::string text = Header(widest);
    for (const auto& [utime, fields] : rows_) text += Row({utime, {}, {}}, fields, paths);
    return text;
  }

 private:
  /// The row with the most fields names the columns.
  std::vector<Field> Widest() const {
    size_t best = 0;
    for (size_t i = 0; i < rows_.size(); ++i)
      if (rows_[i].second.size() > rows_[best].second.size()) best = i;
    return rows_[best].second;
  }
  std::vector<std::pair<int64_t, std::vector<Field>>> rows_;
};

}  // namespace

void RefuseEmpty(const std::string& log, const std::string& channel) {
  if (channel.empty())
    throw std::runtime_error(log + ": holds no message of ours; see chase-log info");
  throw BadOption("--channel " + channel + ": " + log +
                  " holds no message of ours on it; chase-log info lists its channels");
}

int ExportCsv(const std::string& log, const std::string& out, const std::string& channel) {
  LogReader reader(log);
  std::map<std::string, Table> tables;
  for (Event e; reader.Next(&e);)
    if (channel.empty() ? !bus::IsHeavy(e.channel) : e.channel == channel) tables[e.channel].Add(e);
  if (tables.empty()) RefuseEmpty(log, channel);
  std::filesystem::create_directories(out);
  int files = 0;
  for (const auto& [name, table] : tables) {
    if (table.empty()) continue;
    WriteFile((std::filesystem::path(out) / (name + ".csv")).string(), table.Text());
    ++files;
  }
  if (files == 0) RefuseEmpty(log, channel);
  return files;
}

}  // namespace chase::logs
