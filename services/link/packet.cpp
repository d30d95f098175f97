#include "services/link/packet.h"

#include <algorithm>
#include <optional>

namespace chase::link {
namespace {

constexpr uint8_t kMagic[4] = {'C', 'H', 'L', '2'};
constexpr size_t kHeadBytes = 24, kRecordBytes = 11;
constexpr size_t kMostName = Packer::kMostName, kPartBytes = Packer::kPartBytes;
static_assert(kPartBytes + 2 + kRecordBytes + kHeadBytes + kMostName == Packer::kMostBytes);
constexpr size_t kMostOpen = 64;    // messages of which parts are missing
constexpr size_t kMostDone = 4096;  // message numbers that are known to have come: 2 s of a flight
constexpr int64_t kLateWindow = 512;  // packets that may overtake one

template <class T>
void Put(T value, Bytes* bytes) {
  for (int i = static_cast<int>(sizeof(T)) - 1; i >= 0; --i)
    bytes->push_back(static_cast<uint8_t>(static_cast<uint64_t>(value) >> (8 * i)));
}

class Reader {
 public:
  Reader(const uint8_t* data, size_t size) : at_(data), left_(size) {}
  size_t left() const { return left_; }
  const uint8_t* Skip(size_t bytes) {
    if (left_ < bytes) return nullptr;
    const uint8_t* from = at_;
    at_ += bytes;
    left_ -= bytes;
    return from;
  }
  template <class T>
  bool Get(T* value) {
    const uint8_t* from = Skip(sizeof(T));
    if (from == nullptr) return false;
    uint64_t bits = 0;
    for (size_t i = 0; i < sizeof(T); ++i) bits = bits << 8 | from[i];
    *value = static_cast<T>(bits);
    return true;
  }

 private:
  const uint8_t* at_;
  size_t left_;
};

/// The length of the last part, and the exclusive or of all.
Bytes Parity(const uint8_t* data, size_t size) {
  Bytes parity;
  Put(static_cast<uint16_t>((size - 1) % kPartBytes + 1), &parity);
  parity.resize(2 + kPartBytes);
  for (size_t i = 0; i < size; ++i) parity[2 + i % kPartBytes] ^= data[i];
  return parity;
}

/// The parts of a message, of which one is missing, with that one. False where they do not fit
/// together.
bool Restore(std::vector<Bytes>* parts) {
  const size_t n = parts->size() - 1;
  const Bytes parity = parts->back();
  const auto lost =
      std::find_if(parts->begin(), parts->end(), [](const Bytes& p) { return p.empty(); });
  const size_t at = static_cast<size_t>(lost - parts->begin());
  if (at < n) {
    if (parity.size() != 2 + kPartBytes) return false;
    const size_t last = size_t{parity[0]} << 8 | parity[1];
    lost->assign(parity.begin() + 2, parity.end());
    for (size_t i = 0; i < n; ++i)
      for (size_t k = 0; i != at && k < (*parts)[i].size(); ++k) (*lost)[k] ^= (*parts)[i][k];
    if (last < 1 || last > kPartBytes) return false;
    if (at == n - 1) lost->resize(last);
  }
  parts->pop_back();
  return std::all_of(parts->begin(), parts->end() - 1,
                     [](const Bytes& p) { return p.size() == kPartBytes; });
}

}  // namespace

bool Packer::Add(const std::string& channel, const uint8_t* data, size_t size) {
  const size_t parts = std::max<size_t>(1, (size + kPartBytes - 1) / kPartBytes);
  if (channel.empty() || channel.size() > kMostName || parts > kMostParts) return false;
  for (size_t i = 0; i < parts; ++i)
    AddPart(channel, data + i * kPartBytes, std::min(kPartBytes, size - i * kPartBytes), i, parts);
  if (parts > 1) {
    const Bytes parity = Parity(data, size);
    AddPart(channel, parity.data(), parity.size(), parts, parts);
  }
  ++next_message_;
  return true;
}

void Packer::AddPart(const std::string& channel, const uint8_t* data, size_t size, size_t part,
                     size_t parts) {
  const size_t needed = kRecordBytes + channel.size() + size;
  if (!current_.empty() && current_.size() + needed > kMostBytes) {
    full_.push_back(std::move(current_));
    current_.clear();
  }
  if (current_.empty()) Begin();
  Put(next_message_, &current_);
  Put(static_cast<uint16_t>(part), &current_);
  Put(static_cast<uint16_t>(parts), &current_);
  Put(static_cast<uint8_t>(channel.size()), &current_);
  Put(static_cast<uint16_t>(size), &current_);
  current_.insert(current_.end(), channel.begin(), channel.end());
  current_.insert(current_.end(), data, data + size);
}

void Packer::Begin() {
  current_.assign(std::begin(kMagic), std::end(kMagic));
  Put(session_, &current_);
  Put(heard_, &current_);
  Put(next_packet_++, &current_);
}

void Packer::Hear(const Unpacker& other) {
  heard_ = other.session();
  if (other.heard() > session_ && other.heard() < INT64_MAX) session_ = other.heard() + 1;
}

std::vector<Bytes> Packer::Take(bool idle) {
  if (current_.empty() && full_.empty() && idle) Begin();
  if (!current_.empty()) full_.push_back(std::move(current_));
  current_.clear();
  std::vector<Bytes> taken;
  taken.swap(full_);
  return taken;
}

struct Unpacker::Record {
  uint32_t message = 0;
  uint16_t part = 0, parts = 0;
  std::string channel;
  const uint8_t* data = nullptr;
  size_t size = 0;

  /// Is a part as long as the sender makes it? Nothing else may be added up.
  static bool Fits(uint16_t part, uint16_t parts, uint16_t size) {
    if (parts == 1) return size <= Packer::kMostBytes;
    if (part == parts) return size == 2 + Packer::kPartBytes;
    return part + 1 == parts ? size >= 1 && size <= Packer::kPartBytes : size == Packer::kPartBytes;
  }

  static std::optional<Record> From(Reader* reader) {
    Record r;
    uint8_t name = 0;
    uint16_t size = 0;
    if (!reader->Get(&r.message) || !reader->Get(&r.part) || !reader->Get(&r.parts) ||
        !reader->Get(&name) || !reader->Get(&size))
      return std::nullopt;
    const uint8_t* text = reader->Skip(name);
    r.data = text == nullptr ? nullptr : reader->Skip(size);
    if (r.data == nullptr || name == 0 || name > kMostName || r.parts == 0 || r.part > r.parts ||
        (r.parts == 1 && r.part > 0) || r.parts > Packer::kMostParts ||
        !Fits(r.part, r.parts, size))
      return std::nullopt;
    r.channel.assign(reinterpret_cast<const char*>(text), name);
    r.size = size;
    return r;
  }
};

bool Unpacker::Take(const uint8_t* data, size_t size, std::vector<Message>* messages) {
  advanced_ = false;
  Reader reader(data, size);
  const uint8_t* magic = reader.Skip(sizeof kMagic);
  int64_t session = 0, heard = 0;
  uint32_t number = 0;
  if (magic == nullptr || !std::equal(std::begin(kMagic), std::end(kMagic), magic) ||
      !reader.Get(&session) || !reader.Get(&heard) || !reader.Get(&number))
    return false;
  std::vector<Record> records;  // all or none of a packet
  while (reader.left() > 0) {
    auto record = Record::From(&reader);
    if (!record) return false;
    records.push_back(std::move(*record));
  }
  if (!Follows(session, number)) return false;
  heard_ = heard;
  for (const Record& record : records) Accept(record, messages);
  return true;
}

/// An older session is somebody's recording of it; a packet that is far behind as well.
bool Unpacker::Follows(int64_t session, uint32_t number) {
  if (session < session_ || (session == session_ && int64_t{number} + kLateWindow < next_))
    return false;
  if (session > session_) {
    *this = Unpacker();
    session_ = session;
    next_ = number;
  }
  if (number >= next_) {
    lost_ += number - next_;
    const int64_t first = std::max<int64_t>(next_, int64_t{number} - kLateWindow);
    for (int64_t n = first; n < number; ++n) missing_.insert(n);
    next_ = number + 1;
    advanced_ = true;
  } else if (missing_.erase(number) == 0) {
    return true;  // once more
  } else {
    --lost_;  // it was only late
  }
  missing_.erase(missing_.begin(), missing_.lower_bound(int64_t{next_} - kLateWindow));
  ++packets_;
  return true;
}

void Unpacker::Accept(const Record& record, std::vector<Message>* messages) {
  if (IsDone(record.message)) return;
  if (record.parts == 1) {
    Finish(record.message);
    messages->push_back({record.channel, {record.data, record.data + record.size}});
    return;
  }
  if (open_.count(record.message) == 0 && open_.size() >= kMostOpen) open_.erase(open_.begin());
  Open& open = open_[record.message];
  if (open.parts.empty()) {
    open.channel = record.channel;
    open.parts.resize(record.parts + size_t{1});
    open.missing = record.parts + size_t{1};
  }
  if (open.parts.size() != record.parts + size_t{1} || open.channel != record.channel) return;
  Bytes& part = open.parts[record.part];
  if (!part.empty() || record.size == 0) return;
  part.assign(record.data, record.data + record.size);
  if (--open.missing > 1) return;
  if (!Restore(&open.parts)) {
    open_.erase(record.message);
    return;
  }
  Message whole{open.channel, {}};
  for (const Bytes& p : open.parts) whole.bytes.insert(whole.bytes.end(), p.begin(), p.end());
  Finish(record.message);
  messages->push_back(std::move(whole));
}

void Unpacker::Finish(uint32_t message) {
  open_.erase(message);
  done_.insert(message);
  done_order_.push_back(message);
  if (done_order_.size() <= kMostDone) return;
  done_.erase(done_order_.front());
  done_order_.pop_front();
}

}  // namespace chase::link
