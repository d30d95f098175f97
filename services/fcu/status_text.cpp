#include "services/fcu/status_text.h"

namespace chase::fcu {
namespace {

constexpr int64_t kPatience = 5'000'000;  // us; then an unfinished text makes room
constexpr std::size_t kMostOpen = 8;
constexpr int kMostChunks = 40;  // 2000 characters

std::string Printable(std::string_view raw) {
  std::string text(raw);
  for (char& c : text)
    if (c < 0x20 || c > 0x7E) c = ' ';
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

}  // namespace

std::optional<StatusText> StatusTexts::Add(int64_t utime, const mav::Statustext& m) {
  const std::string_view raw = mavlink::Text(m.text);
  if (m.id == 0) return StatusText{m.severity, Printable(raw)};
  for (auto it = open_.begin(); it != open_.end();)
    it = utime - it->second.begun > kPatience ? open_.erase(it) : std::next(it);
  if (open_.size() >= kMostOpen && open_.count(m.id) == 0) open_.erase(open_.begin());
  Open& open = open_.try_emplace(m.id, Open{{m.severity, ""}, utime, 0}).first->second;
  if (m.chunk_seq != open.next) open.text.text += "...";
  open.text.text += raw;
  open.next = m.chunk_seq + 1;
  const bool is_last = raw.size() < m.text.size() || open.next >= kMostChunks;
  if (!is_last) return std::nullopt;
  const StatusText whole{open.text.severity, Printable(open.text.text)};
  open_.erase(m.id);
  return whole;
}

}  // namespace chase::fcu
