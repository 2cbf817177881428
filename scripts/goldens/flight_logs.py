"""One flight in every format of flight logs that camsim reads, written by other programs: tests/data/flights. A climbing circle: north
100 sin(0.2 t), east 100 (1 - cos(0.2 t)), up t metres about 47 N 8 E 500 m, for 20 s; heading 0.2 t, bank of the coordinated turn, pitch
of the climb. Heights are written as given, whatever the format says that they are above.

    pip install aerofiles==1.5.6 geographiclib==2.1 mcap==1.6.0 mcap-ros2-support==0.6.0 pymap3d==3.2.0 pymavlink==2.4.50 pyulog==1.3.0 \
        rosbags==0.11.9 simplekml==1.3.6 && python scripts/goldens/flight_logs.py
"""
import csv
import datetime
import io
import pathlib
import shutil
import struct
import tempfile

import numpy as np
import pymap3d
import simplekml
from aerofiles.igc import Writer as IgcWriter
from geographiclib.geodesic import Geodesic
from mcap.writer import CompressionType
from mcap_ros2.writer import Writer as Ros2Writer
from pymavlink import DFReader
from pyulog import ULog
from rosbags.rosbag2 import StoragePlugin, Writer as Rosbag2Writer
from rosbags.typesys import Stores, get_typestore

OUT = pathlib.Path(__file__).parents[2] / "tests/data/flights"
ORIGIN = (47.0, 8.0, 500.0)
RADIUS, RATE, CLIMB, SECONDS = 100.0, 0.2, 1.0, 20.0
BANK = np.arctan(RADIUS * RATE**2 / 9.80665)
PITCH = np.arctan(CLIMB / (RADIUS * RATE))
START = datetime.datetime(2023, 5, 1, 10, 0, 0, tzinfo=datetime.timezone.utc)


def ned(t):
    return RADIUS * np.sin(RATE * t), RADIUS * (1 - np.cos(RATE * t)), -CLIMB * t


def geodetic(t):
    return pymap3d.ned2geodetic(*ned(t), *ORIGIN)


def quaternion(t):
    """w, x, y, z of Rz(yaw) Ry(pitch) Rx(bank): forward-right-down to north-east-down."""
    (cr, sr), (cp, sp), (cy, sy) = [(np.cos(a / 2), np.sin(a / 2)) for a in (BANK, PITCH, RATE * t)]
    return cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy


def ros_quaternion(t):
    """x, y, z, w: forward-left-up to east-north-up, by matrices."""
    w, x, y, z = quaternion(t)
    m = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                  [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                  [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
    enu_from_ned = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
    m = enu_from_ned @ m @ np.diag([1, -1, -1])
    values, vectors = np.linalg.eigh(np.array([
        [m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0], m[2, 1] - m[1, 2]],
        [m[0, 1] + m[1, 0], m[1, 1] - m[0, 0] - m[2, 2], m[1, 2] + m[2, 1], m[0, 2] - m[2, 0]],
        [m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], m[2, 2] - m[0, 0] - m[1, 1], m[1, 0] - m[0, 1]],
        [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], m[0, 0] + m[1, 1] + m[2, 2]]]))
    return tuple(float(v) for v in vectors[:, np.argmax(values)])


def times(hz):
    return np.arange(int(SECONDS * hz) + 1) / hz


def ulog(name, formats, topics, samples):
    """A ULog file: built here, read and written again by pyulog."""
    def message(kind, body):
        return struct.pack("<HB", len(body), ord(kind)) + body

    data = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 1_000_000) + message("B", bytes(40))
    for text in formats:
        data += message("F", text.encode())
    for index, (topic, instance) in enumerate(topics):
        data += message("A", struct.pack("<BH", instance, index) + topic.encode())
    for _, index, body in sorted(samples, key=lambda sample: sample[0]):
        data += message("D", struct.pack("<H", index) + body)
    with tempfile.TemporaryDirectory() as folder:
        built = pathlib.Path(folder) / "built.ulg"
        built.write_bytes(data)
        ULog(str(built)).write_ulog(str(OUT / name))
    read = ULog(str(OUT / name))
    assert {d.name for d in read.data_list} == {topic for topic, _ in topics}, name


def px4():
    us = lambda t: int(t * 1e6) + 2_000_000
    q = lambda t: struct.pack("<4f", *quaternion(t))
    attitude = "vehicle_attitude:uint64_t timestamp;float[4] q;"
    sphere = Geodesic(6371000.0, 0.0)

    def local(t):
        lat, lon, alt = geodetic(t)
        line = sphere.Inverse(ORIGIN[0], ORIGIN[1], lat, lon)
        azimuth = np.radians(line["azi1"])
        return line["s12"] * np.cos(azimuth), line["s12"] * np.sin(azimuth), ORIGIN[2] - alt

    samples = [(us(t), 0, struct.pack("<Q", us(t)) + q(t)) for t in times(20)]
    samples += [(us(t), 1, struct.pack("<Q3f2df4B", us(t), *local(t), ORIGIN[0], ORIGIN[1], ORIGIN[2], 1, 1, 1, 1)) for t in times(10)]
    ulog("px4_local.ulg", [attitude, "vehicle_local_position:uint64_t timestamp;float x;float y;float z;double ref_lat;double ref_lon;"
         "float ref_alt;bool xy_valid;bool z_valid;bool xy_global;bool z_global;"],
         [("vehicle_attitude", 0), ("vehicle_local_position", 0)], samples)
    samples = [(us(t), 0, struct.pack("<Q", us(t)) + q(t)) for t in times(20)]
    for t in times(5):
        lat, lon, alt = geodetic(t)
        samples.append((us(t), 1, struct.pack("<Q4iB", us(t), round(lat * 1e7), round(lon * 1e7), round(alt * 1e3), round((alt + 47) * 1e3), 3)))
        samples.append((us(t), 2, struct.pack("<Q2d2f", us(t), lat, lon, alt, alt + 47)))
    ulog("px4_global.ulg", [attitude, "vehicle_gps_position:uint64_t timestamp;int32_t lat;int32_t lon;int32_t alt;int32_t alt_ellipsoid;"
         "uint8_t fix_type;", "vehicle_global_position:uint64_t timestamp;double lat;double lon;float alt;float alt_ellipsoid;"],
         [("vehicle_attitude", 0), ("vehicle_gps_position", 0), ("vehicle_global_position", 0)], samples)


def ardupilot():
    """A DataFlash file: messages packed by pymavlink, and read again by it."""
    formats = {}
    data = b""

    def define(kind, name, letters, columns):
        nonlocal data
        length = 3 + sum(struct.calcsize("<" + DFReader.FORMAT_TO_STRUCT[letter][0]) for letter in letters)
        formats[name] = DFReader.DFFormat(kind, name, length, letters, columns)
        data += struct.pack("<BBBBB4s16s64s", 0xA3, 0x95, 128, kind, length, name.encode(), letters.encode(), columns.encode())

    def write(name, *values):
        nonlocal data
        fmt = formats[name]
        scaled = [v / m if m else v for v, m in zip(values, fmt.msg_mults)]
        packed = [round(v) if f not in "fdg" else v for v, f in zip(scaled, fmt.format)]
        data += DFReader.DFMessage(fmt, packed, True, None).get_msgbuf()

    define(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
    define(10, "ATT", "Qccccccc", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP")
    define(11, "POS", "QLLf", "TimeUS,Lat,Lng,Alt")
    define(12, "AHR2", "QccCfLL", "TimeUS,Roll,Pitch,Yaw,Alt,Lat,Lng")
    define(13, "XKF1", "QBccCfff", "TimeUS,C,Roll,Pitch,Yaw,PN,PE,PD")
    define(14, "ORGN", "QBLLe", "TimeUS,Type,Lat,Lng,Alt")
    define(15, "GPS", "QBBIHLLe", "TimeUS,I,Status,GMS,GWk,Lat,Lng,Alt")
    write("ORGN", 1_500_000, 0, *ORIGIN)
    bank, pitch = np.degrees([BANK, PITCH])
    for i, t in enumerate(times(20)):
        us, yaw = int(t * 1e6) + 2_000_000, np.degrees(RATE * t)
        lat, lon, alt = geodetic(t)
        write("ATT", us, 0, bank, 0, pitch, 0, (yaw + 180) % 360 - 180, 0)
        if i % 2 == 0:
            write("POS", us, lat, lon, alt)
            for core in range(2):
                # ArduPilot's own offset of locations: 0.011131884502145034 m per 1e-7 degrees.
                per_deg = 0.011131884502145034 * 1e7
                n, e = (lat - ORIGIN[0]) * per_deg, (lon - ORIGIN[1]) * per_deg * np.cos(np.radians((lat + ORIGIN[0]) / 2))
                write("XKF1", us, core, bank, pitch, yaw % 360, n + core, e, ORIGIN[2] - alt)
            write("AHR2", us, bank, pitch, yaw % 360, alt + 3, lat, lon)
        if i % 4 == 0:
            write("GPS", us, 0, 3 if i > 8 else 1, 122_418_000 + int(t * 1e3), 2260, lat, lon, alt)
    (OUT / "ardupilot.bin").write_bytes(data)
    log = DFReader.DFReader_binary(str(OUT / "ardupilot.bin"))
    first = {}
    while (message := log.recv_msg()) is not None:
        first.setdefault(message.get_type(), message)
    assert abs(first["ATT"].Roll - bank) < 0.01 and abs(first["POS"].Lat - 47) < 0.01


def igc():
    with open(OUT / "glider.igc", "wb") as file:
        writer = IgcWriter(file)
        writer.write_headers({"manufacturer_code": "XXX", "logger_id": "TBX", "date": START.date(), "logger_type": "camsim,golden",
                              "firmware_revision": "1", "hardware_revision": "1", "gps_receiver": "none", "pressure_sensor": "none"})
        writer.write_fix_extensions([("LAD", 2), ("LOD", 2)])
        for t in times(1):
            lat, lon, alt = geodetic(t)
            def more(value):
                thousandths = abs(value) % 1 * 60 * 1000
                return f"{int(thousandths % 1 * 100):02d}"
            # The writer rounds; the extensions continue a number that was cut off.
            cut = lambda value: np.floor(value * 60000) / 60000 + 1e-9
            writer.write_fix(START + datetime.timedelta(seconds=float(t)), latitude=cut(lat), longitude=cut(lon), valid=True,
                             pressure_alt=round(alt - 30), gps_alt=round(alt), extensions=[more(lat), more(lon)])
        # A fix without a height, as receivers write under trees.
        writer.write_fix(START + datetime.timedelta(seconds=21), latitude=ORIGIN[0], longitude=ORIGIN[1], valid=False,
                         pressure_alt=500, gps_alt=0, extensions=["00", "00"])


def kml():
    document = simplekml.Kml()
    track = document.newgxtrack(name="flight", altitudemode=simplekml.AltitudeMode.absolute)
    stamps = [(START + datetime.timedelta(seconds=float(t))).isoformat(timespec="milliseconds").replace("+00:00", "Z") for t in times(10)]
    positions = [geodetic(t) for t in times(10)]
    track.newwhen(stamps)
    track.newgxcoord([(lon, lat, alt) for lat, lon, alt in positions])
    track.newgxangle([tuple(np.degrees([RATE * t, PITCH, BANK])) for t in times(10)])
    document.save(str(OUT / "track.kml"))
    document = simplekml.Kml()
    line = document.newlinestring(name="path", coords=[(lon, lat, alt) for lat, lon, alt in positions[:20]])
    line.altitudemode = simplekml.AltitudeMode.absolute
    document.save(str(OUT / "path.kml"))


STAMPED = "std_msgs/Header header\ngeometry_msgs/Pose pose\n" + "=" * 80 + "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" \
    + "=" * 80 + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n" + "=" * 80 + "\nMSG: geometry_msgs/Pose\ngeometry_msgs/Point position\n" \
    + "geometry_msgs/Quaternion orientation\n" + "=" * 80 + "\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n" + "=" * 80 \
    + "\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"


def pose_mcap(name, compression):
    with open(OUT / name, "wb") as file:
        writer = Ros2Writer(file, compression=compression)
        schema = writer.register_msgdef("geometry_msgs/msg/PoseStamped", STAMPED)
        for t in times(10):
            n, e, d = ned(t)
            stamp = {"sec": 1682935200 + int(t), "nanosec": round(t % 1 * 1e9)}
            pose = {"position": dict(zip("xyz", (e, n, -d))), "orientation": dict(zip("xyzw", ros_quaternion(t)))}
            writer.write_message("/pose", schema, {"header": {"stamp": stamp, "frame_id": "map"}, "pose": pose},
                                 log_time=int((1682935200.01 + t) * 1e9), publish_time=int((1682935200.01 + t) * 1e9))
        writer.finish()


def rosbag(name, write):
    """A bag of rosbag2, as the program rosbags writes it."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    with tempfile.TemporaryDirectory() as folder:
        bag = pathlib.Path(folder) / "bag"
        with Rosbag2Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            write(writer, store)
        shutil.copy(next(bag.glob("*.mcap")), OUT / name)


def stamp_of(store, t, frame):
    time = store.types["builtin_interfaces/msg/Time"](sec=1682935200 + int(t), nanosec=round(t % 1 * 1e9))
    return store.types["std_msgs/msg/Header"](stamp=time, frame_id=frame)


def odometry_bag(writer, store):
    types = store.types
    kinds = {"/odom": "nav_msgs/msg/Odometry", "/pose_cov": "geometry_msgs/msg/PoseWithCovarianceStamped", "/tf": "tf2_msgs/msg/TFMessage"}
    connections = {topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in kinds.items()}
    point, vector, quat = (types[f"geometry_msgs/msg/{n}"] for n in ("Point", "Vector3", "Quaternion"))
    for t in times(1):
        n, e, d = ned(t)
        x, y, z, w = ros_quaternion(t)
        pose = types["geometry_msgs/msg/PoseWithCovariance"](
            pose=types["geometry_msgs/msg/Pose"](position=point(x=e, y=n, z=-d), orientation=quat(x=x, y=y, z=z, w=w)), covariance=np.zeros(36))
        twist = types["geometry_msgs/msg/TwistWithCovariance"](
            twist=types["geometry_msgs/msg/Twist"](linear=vector(x=0.0, y=0.0, z=0.0), angular=vector(x=0.0, y=0.0, z=0.0)), covariance=np.zeros(36))
        transform = types["geometry_msgs/msg/Transform"](translation=vector(x=e, y=n, z=-d), rotation=quat(x=x, y=y, z=z, w=w))
        still = types["geometry_msgs/msg/Transform"](translation=vector(x=1.0, y=0.0, z=0.0), rotation=quat(x=0.0, y=0.0, z=0.0, w=1.0))
        stamped = types["geometry_msgs/msg/TransformStamped"]
        messages = {
            "/odom": types[kinds["/odom"]](header=stamp_of(store, t, "odom"), child_frame_id="base_link", pose=pose, twist=twist),
            "/pose_cov": types[kinds["/pose_cov"]](header=stamp_of(store, t, "odom"), pose=pose),
            "/tf": types[kinds["/tf"]](transforms=[
                stamped(header=stamp_of(store, t, "base_link"), child_frame_id="lidar", transform=still),
                stamped(header=stamp_of(store, t, "odom"), child_frame_id="base_link", transform=transform)]),
        }
        for topic, message in messages.items():
            writer.write(connections[topic], int((1682935200 + t) * 1e9), store.serialize_cdr(message, kinds[topic]))


def fix_bag(writer, store):
    types = store.types
    fix = writer.add_connection("/fix", "sensor_msgs/msg/NavSatFix", typestore=store)
    imu = writer.add_connection("/imu", "sensor_msgs/msg/Imu", typestore=store)
    vector = types["geometry_msgs/msg/Vector3"](x=0.0, y=0.0, z=0.0)
    for i, t in enumerate(times(4)):
        x, y, z, w = ros_quaternion(t)
        message = types["sensor_msgs/msg/Imu"](
            header=stamp_of(store, t, "imu"), orientation=types["geometry_msgs/msg/Quaternion"](x=x, y=y, z=z, w=w),
            orientation_covariance=np.zeros(9), angular_velocity=vector, angular_velocity_covariance=np.zeros(9),
            linear_acceleration=vector, linear_acceleration_covariance=np.zeros(9))
        writer.write(imu, int((1682935200 + t) * 1e9), store.serialize_cdr(message, "sensor_msgs/msg/Imu"))
        if i % 2 == 0:
            lat, lon, alt = geodetic(t)
            status = types["sensor_msgs/msg/NavSatStatus"](status=-1 if i == 16 else 0, service=1)
            message = types["sensor_msgs/msg/NavSatFix"](
                header=stamp_of(store, t, "gps"), status=status, latitude=0.0 if i == 16 else lat, longitude=lon, altitude=alt,
                position_covariance=np.zeros(9), position_covariance_type=0)
            writer.write(fix, int((1682935200 + t) * 1e9), store.serialize_cdr(message, "sensor_msgs/msg/NavSatFix"))


def dji():
    """Column names and forms of a flight record as DJI's exports on the web write it; feet, and dates of the United States."""
    with open(OUT / "dji_flight_record.csv", "w", newline="") as file:
        file.write("sep=,\r\n")
        rows = csv.writer(file)
        rows.writerow(["CUSTOM.date [local]", "CUSTOM.updateTime [local]", "OSD.flyTime", "OSD.flyTime [s]", "OSD.latitude", "OSD.longitude",
                       "OSD.height [ft]", "OSD.heightMax [ft]", "OSD.vpsHeight [ft]", "OSD.altitude [ft]", "OSD.hSpeed [MPH]", "OSD.pitch",
                       "OSD.roll", "OSD.yaw", "OSD.yaw [360]", "OSD.gpsNum", "GIMBAL.mode", "GIMBAL.pitch", "GIMBAL.roll", "GIMBAL.yaw",
                       "GIMBAL.yaw [360]", "CAMERA.isPhoto"])
        for t in times(10):
            lat, lon, alt = geodetic(t)
            clock = START + datetime.timedelta(seconds=float(t))
            yaw = np.degrees(RATE * t)
            rows.writerow([f"{clock.month}/{clock.day}/{clock.year}", clock.strftime("%I:%M:%S.%f %p").lstrip("0"), f"0m {t:.1f}s", f"{t:.1f}",
                           f"{lat:.9f}", f"{lon:.9f}", f"{(alt - 500) / 0.3048:.2f}", "70", "", f"{alt / 0.3048:.3f}", "44.7",
                           f"{np.degrees(PITCH):.3f}", f"{np.degrees(BANK):.3f}", f"{(yaw + 180) % 360 - 180:.3f}", f"{yaw % 360:.3f}", "15",
                           "Follow", "-90", "0", f"{yaw:.1f}", f"{yaw:.1f}", ""])


if __name__ == "__main__":
    OUT.mkdir(exist_ok=True)
    px4()
    ardupilot()
    igc()
    kml()
    pose_mcap("pose_zstd.mcap", CompressionType.ZSTD)
    pose_mcap("pose_lz4.mcap", CompressionType.LZ4)
    pose_mcap("pose_plain.mcap", CompressionType.NONE)
    rosbag("odometry.mcap", odometry_bag)
    rosbag("fix_imu.mcap", fix_bag)
    dji()
    for path in sorted(OUT.iterdir()):
        assert path.stat().st_size < 50_000, path
        print(path.stat().st_size, path.name)
