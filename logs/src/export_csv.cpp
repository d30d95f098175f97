#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <map>
#include <stdexcept>

#include "common/bus/channels.h"
#include "common/logs/log_reader.h"
#include "logs/src/export.h"
#include "logs/src/good_message.h"
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
std::string Row(int64_t utime, const std::vector<Field>& fields,
                const std::vector<std::string>& paths) {
  std::string line = std::to_string(utime);
  size_t next = 0;
  for (const std::string& path : paths) {
    line += ",";
    if (next < fields.size() && fields[next].path == path) line += Cells(fields[next++]);
  }
  return line + "\n";
}

std::string LongRows(int64_t utime, const std::vector<Field>& fields) {
  std::string rows;
  const auto seq =
      std::find_if(fields.begin(), fields.end(), [](const Field& f) { return f.path == "seq"; });
  const std::string begin =
      fmt::format("{},{},", utime, seq == fields.end() ? 0.0 : seq->numbers[0]);
  for (const Field& f : fields)
    for (size_t i = 0; i < std::max(f.numbers.size(), f.texts.size()); ++i)
      fmt::format_to(std::back_inserter(rows), "{}{},{},{}\n", begin, f.path, i,
                     f.texts.empty() ? fmt::format("{}", f.numbers[i]) : Quoted(f.texts[i]));
  return rows;
}

/// One file. The wide form waits for the end: the message with the most fields names the columns.
class Table {
 public:
  Table(const std::string& file, bool long_form) : out_(file), long_form_(long_form) {
    if (long_form) out_.Write("event_utime,seq,field,index,value\n");
  }
  void Add(int64_t utime, const std::vector<Field>& fields) {
    if (long_form_)
      out_.Write(LongRows(utime, fields));
    else
      rows_.push_back({utime, fields});
  }
  void Close() {
    if (!long_form_) WriteWide();
    out_.Close();
  }

 private:
  void WriteWide() {
    const auto& widest =
        std::max_element(rows_.begin(), rows_.end(), [](const auto& a, const auto& b) {
          return a.second.size() < b.second.size();
        })->second;
    std::vector<std::string> paths;
    for (const Field& f : widest) paths.push_back(f.path);
    out_.Write(Header(widest));
    for (const auto& [utime, fields] : rows_) out_.Write(Row(utime, fields, paths));
  }

  OutputFile out_;
  bool long_form_;
  std::vector<std::pair<int64_t, std::vector<Field>>> rows_;
};

}  // namespace

void RefuseEmpty(const std::string& log, const std::string& channel, const Notes& unreadable) {
  if (!unreadable.empty())
    throw std::runtime_error(fmt::format("{}: {}", log, fmt::join(unreadable, "; ")));
  if (channel.empty())
    throw std::runtime_error(log + ": holds no message of ours; see chase-log info");
  throw BadOption("--channel " + channel + ": " + log +
                  " holds no message of ours on it; chase-log info lists its channels");
}

int ExportCsv(const std::string& log, const std::string& out, const std::string& channel,
              bool long_form, const Watch& watch, Notes* notes) {
  LogReader reader(log, watch);
  std::map<std::string, Table> tables;
  Unreadable unreadable;
  for (LogEvent e; reader.Next(&e);) {
    if (channel.empty() ? bus::IsHeavy(e.channel) : e.channel != channel) continue;
    unreadable.Add(e);
    const auto fields = FieldsOf(e.bytes);
    if (!fields) continue;
    std::error_code error;
    std::filesystem::create_directories(out, error);
    if (error) throw std::runtime_error(out + ": is no folder and cannot be made one");
    const std::string file = (std::filesystem::path(out) / (e.channel + ".csv")).string();
    tables.try_emplace(e.channel, file, long_form).first->second.Add(e.utime, *fields);
  }
  if (notes) *notes = unreadable.Lines();
  if (tables.empty()) RefuseEmpty(log, channel, unreadable.Lines());
  for (auto& [name, table] : tables) table.Close();
  return static_cast<int>(tables.size());
}

}  // namespace chase::logs
