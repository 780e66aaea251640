# docker build --tag swarm-logistics .
# docker run --rm --volume "$PWD:/work" swarm-logistics judge homing --out results
FROM python:3.12-slim

WORKDIR /opt/swarm-logistics-env
COPY . .
RUN pip install --no-cache-dir --constraint constraints.txt ".[study,render]"

# Not as root. Kernels are compiled once, for the processor of this machine; on another one they are compiled again.
RUN useradd --create-home --uid 1000 swarm && mkdir /work && chown swarm /work
USER swarm
ENV NUMBA_CACHE_DIR=/home/swarm/kernels
RUN swarm-logistics run --policy ppo-robust --set duration=5

WORKDIR /work
ENTRYPOINT ["swarm-logistics"]
CMD ["--help"]
