"""A client of RTDE on sockets, with what `elastocal.drivers.rtde` uses of the package ``ur-rtde``.

Written from the description of the interface; it shares no code with the simulator. ``ur-rtde``
itself holds Python's lock while it waits, so that its server has to be another process; this
client does not.
"""

import socket
import struct
import threading
import time
from types import SimpleNamespace

_TYPES = {"DOUBLE": "d", "VECTOR6D": "6d", "INT32": "i", "UINT32": "I"}
_SEEN = (
    "timestamp,actual_q,actual_TCP_pose,actual_TCP_force,ft_raw_wrench,robot_mode,safety_mode,"
    "runtime_state,output_int_register_0,output_int_register_2"
)
_INTS = [f"input_int_register_{n}" for n in range(8)]
_DOUBLES = [f"input_double_register_{n}" for n in range(18)]
_READY, _DONE = 1, 2
_PATIENCE = 60.0
"""For anything, in s of the wall: a loaded machine is slow, and a test must not be."""


class RtdeClient:
    """Messages of RTDE."""

    def __init__(self, address, port):
        self.socket = socket.create_connection((address, port), _PATIENCE)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, kind, payload=b""):
        self.socket.sendall(struct.pack(">HB", 3 + len(payload), ord(kind)) + payload)

    def receive(self):
        size, kind = struct.unpack(">HB", self._exactly(3))
        return chr(kind), self._exactly(size - 3)

    def ask(self, kind, payload=b""):
        self.send(kind, payload)
        while True:
            got, answer = self.receive()
            if got == kind:
                return answer

    def _exactly(self, count):
        data = b""
        while len(data) < count:
            more = self.socket.recv(count - len(data))
            if not more:
                raise ConnectionError("the controller closed the line")
            data += more
        return data

    def close(self):
        self.socket.close()


class UrClient:
    """Receiving and commanding half in one."""

    def __init__(self, server, address="127.0.0.1", rate=125.0):
        ports = server.ports
        self._rtde = RtdeClient(address, ports["rtde"])
        assert self._rtde.ask("V", struct.pack(">H", 2)) == b"\x01"
        answer = self._rtde.ask("O", struct.pack(">d", rate) + _SEEN.encode())
        self._layout = [
            (n, _TYPES[t])
            for n, t in zip(_SEEN.split(","), answer[1:].decode().split(","), strict=True)
        ]
        self._recipe = self._rtde.ask("I", ",".join(_INTS + _DOUBLES).encode())[0]
        self._values, self._new = {}, threading.Condition()
        assert self._rtde.ask("S") == b"\x01"
        self._alive = True
        self._ints, self._doubles = [0] * 8, [0.0] * 18
        threading.Thread(target=self._hear, daemon=True).start()
        self._until(lambda: self._values)
        self._script = (address, ports["script"])
        self.offset = None

    def _hear(self):
        layout = struct.Struct(">B" + "".join(t for _, t in self._layout))
        while self._alive:
            try:
                kind, payload = self._rtde.receive()
            except OSError:
                self._alive = False
                return
            if kind != "U":
                continue
            numbers, values = [*layout.unpack(payload)][1:], {}
            for name, kind in self._layout:
                count = int(kind[:-1] or 1)
                each, numbers = numbers[:count], numbers[count:]
                values[name] = each if count > 1 else each[0]
            with self._new:
                self._values = values
                self._new.notify_all()

    def _until(self, holds):
        end = time.monotonic() + _PATIENCE
        with self._new:
            while not holds():
                if not self._alive:
                    raise ConnectionError("the controller closed the line")
                assert time.monotonic() < end, "the controller did not answer"
                self._new.wait(0.1)

    def _command(self, number, ints=(), doubles=(), wanted=_DONE):
        self._ints[0] = number
        self._ints[1 : 1 + len(ints)] = [int(each) for each in ints]
        self._doubles[: len(doubles)] = [float(each) for each in doubles]
        self._put()
        if wanted == _DONE:
            self._until(lambda: self._values["output_int_register_0"] == _DONE)
            self._ints[0] = 0
            self._put()
            self._until(lambda: self._values["output_int_register_0"] == _READY)
        return True

    def _put(self):
        values = struct.pack(">B8i18d", self._recipe, *self._ints, *self._doubles)
        self._rtde.send("U", values)

    # what is received
    def isConnected(self):
        return self._alive

    def getTimestamp(self):
        return self._values["timestamp"]

    def getActualQ(self):
        return self._values["actual_q"]

    def getActualTCPPose(self):
        return self._values["actual_TCP_pose"]

    def getActualTCPForce(self):
        return self._values["actual_TCP_force"]

    def getFtRawWrench(self):
        return self._values["ft_raw_wrench"]

    def getRobotMode(self):
        return self._values["robot_mode"]

    def getSafetyMode(self):
        return self._values["safety_mode"]

    # what is commanded
    def isProgramRunning(self):
        return self._values["runtime_state"] == 2

    def reuploadScript(self):
        with socket.create_connection(self._script, _PATIENCE) as line:
            line.sendall(b"def rtde_control():\n  global reg_offset_int = 0\nend\n")
            self._until(self.isProgramRunning)
        self._until(lambda: self._values["output_int_register_0"] == _READY)
        return True

    def setWatchdog(self, min_frequency):
        return self._command(35, (), (min_frequency,))

    def kickWatchdog(self):
        self._put()
        return True

    def setTcp(self, pose):
        return self._command(29, (), pose)

    def setPayload(self, mass, cog):
        return self._command(17, (), (mass, *cog))

    def moveJ(self, q, speed, acceleration, asynchronous):
        return self._command(1, (asynchronous,), (*q, speed, acceleration))

    def moveL(self, pose, speed, acceleration, asynchronous):
        return self._command(3, (asynchronous,), (*pose, speed, acceleration))

    def getAsyncOperationProgressEx(self):
        running = bool(self._values["output_int_register_2"] & (1 << 15))
        return SimpleNamespace(isAsyncOperationRunning=lambda: running)

    def forceMode(self, task_frame, selection, wrench, kind, limits):
        return self._command(6, (kind, *selection), (*task_frame, *wrench, *limits), _READY)

    def forceModeStop(self):
        return self._command(7)

    def zeroFtSensor(self):
        return self._command(8)

    def stopJ(self, deceleration, asynchronous):
        self._command(34, (asynchronous,), (deceleration,))

    def stopScript(self):
        self._command(255, wanted=_READY)

    def disconnect(self):
        self._alive = False
        self._rtde.close()
