# squeal on Debian 12, from the sources beside this file:
#   docker build -t squeal .
#   docker run --rm -v "$PWD":/work squeal my_brake.prm
FROM debian:12 AS build
COPY . /squeal
WORKDIR /squeal
RUN apt-get update && scripts/install-dependencies.sh --package && scripts/build.sh release squeal && scripts/package.sh /package

FROM debian:12
COPY --from=build /package /package
# Tables and pages; pictures of modes need ParaView, which triples the size: apt-get install paraview python3-paraview xvfb xauth
RUN apt-get update && apt-get install -y --no-install-recommends /package/*.deb python3-matplotlib \
    && rm -rf /package /var/lib/apt/lists/*
# Open MPI refuses root, which containers are, unless it is told.
ENV OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
WORKDIR /work
ENTRYPOINT ["squeal"]
