//! Requests to web servers, over one pool of connections.

use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use http_body_util::BodyExt;
use hyper_util::client::legacy::Client;
use hyper_util::client::legacy::connect::HttpConnector as Tcp;
use hyper_util::rt::{TokioExecutor, TokioTimer};
use object_store::ClientOptions;
use object_store::client::{
    HttpClient, HttpConnector, HttpError, HttpErrorKind, HttpRequest, HttpRequestBody, HttpResponse, HttpResponseBody,
    HttpService,
};

use crate::seen::Seen;

#[cfg(feature = "cloud")]
type Connector = hyper_rustls::HttpsConnector<Tcp>;
#[cfg(not(feature = "cloud"))]
type Connector = Tcp;

/// Makes the client through which `object_store` sends its requests. Redirections are not followed.
#[derive(Debug)]
pub(crate) struct Web {
    pub(crate) connect_timeout: Duration,
}

impl HttpConnector for Web {
    fn connect(&self, _: &ClientOptions) -> object_store::Result<HttpClient> {
        let mut tcp = Tcp::new();
        tcp.set_connect_timeout(Some(self.connect_timeout));
        tcp.set_nodelay(true);
        let mut builder = Client::builder(TokioExecutor::new());
        let client = builder.pool_timer(TokioTimer::new()).build(connector(tcp)?);
        Ok(HttpClient::new(Service { client }))
    }
}

#[cfg(not(feature = "cloud"))]
fn connector(tcp: Tcp) -> object_store::Result<Connector> {
    Ok(tcp)
}

#[cfg(feature = "cloud")]
fn connector(mut tcp: Tcp) -> object_store::Result<Connector> {
    // What comes here is http or https; the connector over it knows which.
    tcp.enforce_http(false);
    let builder = hyper_rustls::HttpsConnectorBuilder::new().with_native_roots();
    let builder = builder.map_err(|e| object_store::Error::Generic { store: "HTTPS", source: Box::new(e) })?;
    Ok(builder.https_or_http().enable_http1().wrap_connector(tcp))
}

#[derive(Debug)]
struct Service {
    client: Client<Connector, HttpRequestBody>,
}

#[async_trait]
impl HttpService for Service {
    async fn call(&self, request: HttpRequest) -> Result<HttpResponse, HttpError> {
        let seen = request.extensions().get::<Arc<Seen>>().cloned();
        let answer = self.client.request(request).await;
        let (head, body) = answer.map_err(|e| told(if e.is_connect() { CONNECT } else { REQUEST }, &e))?.into_parts();
        if let Some(seen) = seen {
            // `object_store` does not tell it by its errors.
            seen.note(head.status.as_u16(), &head.headers);
        }
        let body = body.map_err(|e| told(HttpErrorKind::Interrupted, &e));
        Ok(HttpResponse::from_parts(head, HttpResponseBody::new(body)))
    }
}

const CONNECT: HttpErrorKind = HttpErrorKind::Connect;
const REQUEST: HttpErrorKind = HttpErrorKind::Request;

/// An error of the network with its sources in one line: the first says little.
fn told(kind: HttpErrorKind, error: &(dyn Error + 'static)) -> HttpError {
    let lines: Vec<_> = std::iter::successors(Some(error), |&e| e.source()).map(ToString::to_string).collect();
    HttpError::new(kind, std::io::Error::other(lines.join(": ")))
}
